"""How the cutting force answers a displacement, cell by cell of a tooth period."""
