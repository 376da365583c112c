"""Outlines of what moves swept, from bricks."""
