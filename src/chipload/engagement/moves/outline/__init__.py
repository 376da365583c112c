"""Compiled outlines of what moves swept at a height."""
