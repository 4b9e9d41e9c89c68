"""Excitations for identification: multisines of most information, and the expected intervals."""
