"""Curves of the boundary construction diagram, linked in time and put together to loops."""
