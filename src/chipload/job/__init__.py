"""The job file, from its text to checked values."""

from chipload.job.load import Job, ProgramJob, load_job
from chipload.job.tables import MAY, NEEDS, JobTable, OperationTable, ProgramJobTable

__all__ = ["MAY", "NEEDS", "Job", "JobTable", "OperationTable", "ProgramJob", "ProgramJobTable", "load_job"]
