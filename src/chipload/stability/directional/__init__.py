"""The change of the cutting force by a displacement, for each cell of a tooth period."""
