"""Repair of bags that were cut or damaged: everything that its checksum confirms is kept."""
