"""The result of holding the torque on a thin tube or cone."""
