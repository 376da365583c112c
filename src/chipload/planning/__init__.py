"""Decides the path, the depth, the cutter, the index angle and the feed."""
