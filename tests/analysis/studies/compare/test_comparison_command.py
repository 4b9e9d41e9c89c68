"""`auv analyze` of many scenarios: its files, its report, what it refuses."""

import csv
import json
from html import unescape
from pathlib import Path

import pytest
import yaml
from helpers.report_pages import check_numbers
from pyarrow import parquet

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.cli import main
from auv_analysis.metrics.measures import BY_NAME

SCENARIO = load_scenario('case1')


@pytest.fixture
def scenarios(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Short scenarios of different durations, one of which diverges under cl."""
    monkeypatch.chdir(tmp_path)
    names = {'one': 0.4, 'two': 0.2, 'wild': 0.4}
    for name, duration in names.items():
        data = SCENARIO.data | {'name': name, 'duration': duration, 'vehicle': 'lauv'}
        gvc, cl = data['controllers'].values()
        if name == 'wild':
            data['controllers'] = {'calm': gvc, 'stiff': cl | {'k_D': 1e9}}
        (tmp_path / f'{name}.yaml').write_text(yaml.safe_dump(data, sort_keys=False))
    return [f'{name}.yaml' for name in names]


@pytest.mark.usefixtures('undrawn')
def test_command_compares_scenarios_by_name(scenarios, capsys) -> None:
    main.main(['analyze', *scenarios, '--json'])
    captured = capsys.readouterr()
    summaries = json.loads(captured.out)
    assert list(summaries) == ['one/gvc', 'one/cl', 'two/gvc', 'two/cl',
                               'wild/calm', 'wild/stiff']  # fmt: skip
    assert summaries['wild/stiff'] is None
    assert summaries['one/gvc'] == summarize(simulate(load_scenario('one.yaml'), 'gvc'))
    out = Path('runs/analyze_one_two_wild')
    assert json.loads((out / 'summary.json').read_text()) == summaries
    rows = list(csv.DictReader((out / 'comparison.csv').open()))
    assert [row['run'] for row in rows] == list(summaries)
    assert float(rows[2]['duration']) == 0.2
    report = unescape((out / 'report.html').read_text(encoding='utf-8')).replace('\xa0', ' ')
    assert 'Durations differ: 0.4 s (3 runs) and 0.2 s (2 runs)' in report
    assert '1 of 6 runs failed and have no figures: wild/stiff.' in report
    *notes, failed = [line for line in captured.err.splitlines() if line.startswith('note: ')]
    assert notes == [f'note: {n}: {note}' for n, one in summaries.items() if one
                     for note in one['notes']]  # fmt: skip
    assert 'wild/stiff' in failed
    assert 'diverges' in failed


@pytest.mark.usefixtures('unrendered')
def test_every_number_of_the_report_is_in_the_table(scenarios, approved) -> None:
    main.main(['analyze', *scenarios])
    out = Path('runs/analyze_one_two_wild')
    approved.folder(out)
    table = parquet.read_table(out / 'comparison.parquet').to_pylist()
    assert check_numbers(out) > 200
    assert {f'rank.{name}' for name in BY_NAME} & set(table[0])


def test_all_diverged_is_a_failure(scenarios, capsys, monkeypatch) -> None:
    from auv_analysis.simulation.simulate import DivergedError
    from auv_analysis.studies.compare import report as compare

    reasons = iter('abcdef')

    def diverge(*_):
        raise DivergedError(f'it diverges {next(reasons)}')

    monkeypatch.setattr(compare, 'open_source', diverge)
    with pytest.raises(SystemExit) as end:
        main.main(['analyze', *scenarios])
    assert end.value.code == 1
    assert (
        capsys.readouterr().err.splitlines()[-1] == 'all of 6 runs failed, the first: it diverges a'
    )
    assert not Path('runs').exists()


@pytest.mark.parametrize(
    ('line', 'words'),
    [
        ('sweep one.yaml', 'sweep: expected a sweep alone'),
        ('sweep --by speed', r'--by: expected one of kinetic_energy.mean'),
        ('one.yaml two.yaml --out taken', 'taken: --out: expected a new folder'),
        ('one.yaml gone.yaml', 'gone.yaml'),
    ],
)
def test_wrong_arguments_are_refused_in_one_line(scenarios, line: str, words: str, capsys) -> None:
    for name in ('sweep', 'taken'):
        Path(name).mkdir()
        (Path(name) / 'sweep.json').write_text('{}')
    with pytest.raises(SystemExit) as end:
        main.main(['analyze', *line.split()])
    lines_ = capsys.readouterr().err.splitlines()
    assert (end.value.code, len(lines_)) == (2, 1), lines_
    assert words in lines_[0]
