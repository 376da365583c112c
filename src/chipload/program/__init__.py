"""Programs: made, checked, timed, written."""
