"""From a job to its outcome."""

from chipload.run.planned import Inputs, prove, read_inputs, run_job
from chipload.run.program import run_program

__all__ = ["Inputs", "prove", "read_inputs", "run_job", "run_program"]
