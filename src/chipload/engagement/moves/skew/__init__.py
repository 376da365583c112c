"""Tooth engagement of the contact, with parts of slices on which the borders of the contact run askew."""
