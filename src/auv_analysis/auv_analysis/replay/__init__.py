"""Recorded bags played again: what is published, in which order, when, and what is not."""
