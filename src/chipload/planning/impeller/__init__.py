"""Impellers milled in sections: the largest cutters, at which table angles and pallet angles."""
