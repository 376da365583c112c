"""The Python interface: functions that do with plain values what the commands do with job files.

Tables and keys are those of the job file, with the units in their names; ``docs/jobs.md`` lists them. A function that
plans or simulates builds the same job as a TOML file with these keys. It returns the result and the contents of the
result folder. Libraries are imported when a function is called.
"""
