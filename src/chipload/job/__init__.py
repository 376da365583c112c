"""The job file, from its text to checked values."""

from chipload.job.impeller import ImpellerJob, ImpellerJobTable, SectionalTable
from chipload.job.load import AnyJob, load_job
from chipload.job.planned import Job
from chipload.job.program import ProgramJob
from chipload.job.shell import ShellJob
from chipload.job.tables import MAY, NEEDS, JobTable, OperationTable, ProgramJobTable
from chipload.job.wall import WallJob, WallJobTable

__all__ = [
    "MAY",
    "NEEDS",
    "AnyJob",
    "ImpellerJob",
    "ImpellerJobTable",
    "Job",
    "JobTable",
    "OperationTable",
    "ProgramJob",
    "ProgramJobTable",
    "SectionalTable",
    "ShellJob",
    "WallJob",
    "WallJobTable",
    "load_job",
]
