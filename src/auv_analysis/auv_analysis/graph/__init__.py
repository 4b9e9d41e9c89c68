"""`auv run`: parameter files, processes and domain of a node graph."""
