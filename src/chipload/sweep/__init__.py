"""Sweeps: jobs for all combinations of values of some keys and samples of the material, locally or on a cluster."""

from chipload.lazy import attach

__all__ = ["Case", "Samples", "SweepResult", "cases_of", "run_sweep"]

__getattr__, __dir__ = attach(__name__, {"cases": "Case Samples cases_of", "run": "SweepResult run_sweep"})
