"""The job file, from its text to checked values."""

from chipload.job.load import AnyJob, load_job
from chipload.job.planned import Job
from chipload.job.program import ProgramJob
from chipload.job.tables import MAY, NEEDS, JobTable, OperationTable, ProgramJobTable
from chipload.job.wall import WallJob, WallJobTable

__all__ = [
    "MAY",
    "NEEDS",
    "AnyJob",
    "Job",
    "JobTable",
    "OperationTable",
    "ProgramJob",
    "ProgramJobTable",
    "WallJob",
    "WallJobTable",
    "load_job",
]
