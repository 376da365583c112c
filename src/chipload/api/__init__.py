"""The Python interface: the functions of the command line, from plain values.

Tables and keys are those of the job file, with the units in their names; ``docs/jobs.md`` lists them. Every function
that plans or simulates builds the job that a TOML file of the same keys gives, and gives back its result and what is
written into a result folder. Libraries are imported when a function is called.
"""
