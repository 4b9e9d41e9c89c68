"""The report of an experiment: figures, tables, the paper's claims, one HTML page."""
