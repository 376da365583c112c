"""Steps of one line as one move of the index."""
