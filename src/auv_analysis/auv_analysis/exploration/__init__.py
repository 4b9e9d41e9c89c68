"""The rows of a sweep explored: distributions, what they depend on, what matters, what failed."""
