"""A sweep whose figures are known functions of what varies."""

import pytest
from helpers.made_sweeps import SIMPLE, make_sweep, simple

from auv_analysis.studies.sweep.analysis import Analysis, analysed
from auv_analysis.studies.sweep.dataset import open_sweep


@pytest.fixture(scope='session')
def results(tmp_path_factory: pytest.TempPathFactory) -> Analysis:
    """All that is found in it."""
    return analysed(open_sweep(make_sweep(tmp_path_factory.mktemp('simple'), SIMPLE, simple)))
