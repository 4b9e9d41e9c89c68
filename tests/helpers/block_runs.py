"""Runs whose blocks have another length than is asked for, and blocks as a run again."""

import copy
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from auv_analysis.runs.run import Run


def in_blocks(run: Run, rows: int) -> Run:
    """The same run in blocks of so many samples."""
    same = copy.copy(run)
    object.__setattr__(same, 'blocks', lambda _=0: run.blocks(rows))
    object.__setattr__(same, 'wide_blocks', lambda margin, _=0: run.wide_blocks(margin, rows))
    return same


def joined(parts: Sequence[Run]) -> Run:
    """One run of consecutive parts."""
    arrays = [part.arrays() for part in parts]
    return replace(parts[0], **{n: np.concatenate([a[n] for a in arrays]) for n in arrays[0]})
