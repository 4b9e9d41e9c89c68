"""Tuning: laws at equal effort or equal error, compared over perturbed plants."""
