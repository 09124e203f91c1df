"""A trained memory of the strips: its rows, its training, and how much of it a model uses."""
