"""Runs whose blocks have another length than is asked for."""

import copy

from auv_analysis.runs.run import Run


def in_blocks(run: Run, rows: int) -> Run:
    """The same run in blocks of so many samples."""
    same = copy.copy(run)
    object.__setattr__(same, 'blocks', lambda _=0: run.blocks(rows))
    object.__setattr__(same, 'wide_blocks', lambda margin, _=0: run.wide_blocks(margin, rows))
    return same
