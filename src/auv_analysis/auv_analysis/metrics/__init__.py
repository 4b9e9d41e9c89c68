"""Metrics of runs: energy, coupling, certificate, summary; the registry of quantities."""
