"""Many jobs: every combination of some keys of a job, and samples of its material, on this computer or on a cluster."""

from chipload.lazy import attach

__all__ = ["Case", "Samples", "SweepResult", "cases_of", "run_sweep"]

__getattr__, __dir__ = attach(__name__, {"cases": "Case Samples cases_of", "run": "SweepResult run_sweep"})
