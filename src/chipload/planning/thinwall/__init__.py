"""The depth of cut that a thin wall can bear: thresholds, depths, passes and five-axis paths."""
