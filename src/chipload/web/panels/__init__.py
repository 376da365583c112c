"""The parts of the page: each shows a track and follows its row."""
