"""RS-274 at the edge of a Program."""
