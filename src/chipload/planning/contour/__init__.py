"""Contours finished at constant engagement: the walls, the passes, and what they cost."""
