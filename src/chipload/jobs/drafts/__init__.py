"""Drafts of jobs: what a file states, written as a job whose guesses the user confirms."""
