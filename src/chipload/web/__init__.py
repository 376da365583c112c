"""The page: jobs and results of one folder in the browser of this computer."""
