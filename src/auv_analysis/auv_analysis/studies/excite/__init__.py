"""Excitations for identification: multisines of most information, and the expected intervals."""

SPEED = 0.5  # m/s, where none is asked for
