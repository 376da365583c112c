"""How near a moving tool comes to points of a surface, and how deep into it."""
