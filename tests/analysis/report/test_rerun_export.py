"""The file for the rerun viewer: what is in it, and what is said where rerun is absent."""

import sys
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from helpers.needs import need
from numpy.testing import assert_allclose

from auv_analysis.cli.main import main
from auv_analysis.report import rerun_export
from auv_analysis.runs.run import Run
from auv_dynamics import load_vehicle

SAMPLES = 7


def made_run() -> Run:
    t = 0.01 * np.arange(SAMPLES)
    values = np.outer(1.0 + t, np.arange(1.0, 7.0))
    facts = {'scenario': 'made', 'controller': 'my own', 'law': 'gvc', 'gains': {}, 'step': 0.01}
    signals = dict.fromkeys(
        ('eta', 'nu', 'nu_d', 'nu_d_dot', 'tau', 'disturbance_estimate'), values
    )
    return Run(
        vehicle=load_vehicle('rexrov'), source='bag', t=t, disturbance=None, **facts, **signals
    )


def test_energy_shares_are_per_cent_of_what_moves() -> None:
    run = made_run()
    found = {(kind, whose): values for kind, whose, values in rerun_export.signals(run, run)}
    assert list(found) == [
        ('velocity', 'my own'), ('velocity', 'setpoint'), ('wrench', 'my own'),
        ('energy_shares', 'my own'),
    ]  # fmt: skip
    assert_allclose(found['energy_shares', 'my own'].sum(axis=1), 100.0)


def test_no_setpoint_is_drawn_where_none_is_known() -> None:
    run = made_run()
    run = replace(run, nu_d=np.full_like(run.nu_d, np.nan))
    assert ('velocity', 'setpoint') not in [s[:2] for s in rerun_export.signals(run, run)]


def test_without_rerun_one_line_says_how_to_get_it(monkeypatch, capsys, tmp_path) -> None:
    monkeypatch.setitem(sys.modules, 'rerun', None)
    with pytest.raises(SystemExit) as ended:
        main(['export-rerun', str(tmp_path)])
    assert ended.value.code == 2
    assert capsys.readouterr().err == (
        'rerun-sdk: expected rerun installed: pip install -r requirements-rerun.txt, '
        'found no such module\n'
    )
    assert not list(tmp_path.iterdir())


def test_an_earlier_file_is_not_replaced_unasked(monkeypatch, capsys, tmp_path) -> None:
    monkeypatch.setattr('auv_analysis.report.rerun_export.library', lambda: None)
    (tmp_path / 'gvc.rrd').touch()
    with pytest.raises(SystemExit) as ended:
        main(['export-rerun', str(tmp_path / 'gvc')])
    assert ended.value.code == 2
    assert 'expected a new file, or --overwrite, found an existing file' in capsys.readouterr().err


def test_every_sample_is_in_the_file(monkeypatch, tmp_path: Path) -> None:
    need('rerun-sdk', find_spec('rerun'))
    chunk = import_module('rerun.chunk')
    monkeypatch.setattr(Run, 'blocks', lambda run: (run.part(slice(i, i + 3)) for i in (0, 3, 6)))
    run, path = made_run(), tmp_path / 'made.rrd'
    assert rerun_export.export(run, path) == SAMPLES
    assert list(tmp_path.iterdir()) == [path]
    batches = [
        part.to_record_batch()
        for part in chunk.RrdReader(path).stream().to_chunks()
        if not part.is_static and part.entity_path == '/wrench/yaw/my\\ own'
    ]
    found = [value for batch in batches for (value,) in batch['Scalars:scalars'].to_pylist()]
    assert sorted(found) == run.tau[:, 5].tolist()
