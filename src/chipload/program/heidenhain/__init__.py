"""Heidenhain conversational programs, in part."""
