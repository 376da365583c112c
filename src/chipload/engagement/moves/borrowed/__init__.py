"""Arrays that compiled loops use without counting their references."""
