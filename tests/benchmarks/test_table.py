"""How `make bench` measures in turns, judges and writes its table; no test looks at a clock."""

import json
import subprocess
import sys
from contextlib import ExitStack
from dataclasses import asdict, replace

import keys
import pytest
import run
import table
from load import Load, look, watched
from measure import Measured, interleaved

MACHINE = {'cpu': 'a processor', 'cores': 2, 'memory_gb': 8.0, 'kernel': 'Linux 6'}
CONDITIONS = {'machine': MACHINE, 'versions': {'python': '3.11.7'}}


QUIET, BUSY = Load(0.4, 0.2, 2.2), Load(2.6, 0.5, 4.4)


def measured(ratio, value=1.0, load=QUIET):
    return Measured(value, 's', ratio, 2.0, 7, (ratio, ratio), load)


def test_every_round_calls_each_once_and_every_second_goes_backwards():
    calls = []

    def part(name, values):
        numbers = iter(values)

        def measure():
            calls.append(name)
            return next(numbers)

        return measure

    a = part('a', [99, 2, 4, 9])  # the first call of each is not counted
    b = part('b', [99, 10, 10, 10])
    c = part('c', [99, 1, 2, 3])
    found = interleaved({'a': a, 'b': b}, c, 'ms', runs=3)
    assert ''.join(calls) == 'abc' + 'abc' + 'cba' + 'abc'
    assert found['a'] == Measured(4, 'ms', 2.0, 2, 3, (2.0, 3.0))
    assert found['b'] == Measured(10, 'ms', 5.0, 2, 3, (10 / 3, 10.0))


def test_the_ratio_is_the_median_of_pairs_not_of_columns():
    subject, reference = iter([0, 1, 4, 9]), iter([1, 1, 2, 9])
    found = interleaved({'a': lambda: next(subject)}, lambda: next(reference), 's', runs=3)['a']
    assert (found.ratio, found.value / found.reference) == (1.0, 2.0)


@pytest.mark.parametrize(
    ('ratios', 'rounds'),
    [([2.0, 2.0, 2.0], 3), ([2.0, 2.2, 2.0, 2.1], 7), ([2.0, 2.09, 2.04], 3), ([2.0, 2.2], 2)],
)
def test_rounds_end_when_they_agree(ratios, rounds):
    subject = iter([99.0, *ratios, *([2.0] * 9)])
    found = interleaved({'a': lambda: next(subject)}, lambda: 1.0, 's', runs=max(rounds, 2))['a']
    assert found.runs == rounds
    assert found.spread == (min(ratios), max(ratios))


def test_what_settles_by_itself_is_not_called_unmeasured():
    numbers = iter([1.0, 1.0, 1.0])
    assert interleaved({'a': lambda: next(numbers)}, lambda: 2.0, 's', warm=False)['a'].runs == 3


def test_the_load_of_others_counts_what_runs_beside():
    script = 'print("runs", flush=True)\nwhile True: pass'
    with ExitStack() as stack:
        for _ in range(3):
            command = [sys.executable, '-c', script]
            process = stack.enter_context(subprocess.Popen(command, stdout=subprocess.PIPE))
            stack.callback(process.kill)
            process.stdout.readline()
        with watched() as watch:
            look()
        load = watch.load()
    assert min(watch.seen) >= 3
    assert load.others >= 3
    assert not load.quiet


@pytest.mark.parametrize('ratio', [0.2, 0.7])
def test_nothing_is_judged_beside_busy_programs(ratio):
    busy = measured(ratio, load=BUSY)
    assert keys.BY_NAME['rollout_vs_c'].verdict(busy) == 'not judged: load 2.6'
    assert keys.BY_NAME['bag_read_vs_rosbags'].verdict(busy) == ''
    results = {'rollout_vs_c': asdict(busy), **CONDITIONS}
    row = next(line for line in table.table(results).splitlines() if '`rollout_vs_c`' in line)
    assert row.endswith('| not judged: load 2.6 | 2.6, 50% |')


@pytest.mark.parametrize(
    ('name', 'ratio', 'verdict'),
    [
        ('rollout_vs_c', 0.61, 'MISSED'), ('rollout_vs_c', 0.6, 'met'),
        ('rollout_vs_c', 0.25, 'aim reached'), ('rollout_vs_c', 0.26, 'met'),
        ('threads_2_vs_1', 1.59, 'MISSED'), ('threads_2_vs_1', 1.6, 'met'),
        ('threads_2_vs_1', 1.95, 'aim reached'), ('threads_2_vs_1', 1.9, 'met'),
        ('growth_horizon', 10.1, 'aim reached'), ('growth_horizon', 11.1, 'MISSED'),
    ],
)  # fmt: skip
def test_verdict(name, ratio, verdict):
    assert keys.BY_NAME[name].verdict(measured(ratio)) == verdict


@pytest.mark.parametrize(
    ('value', 'ratio', 'verdict'),
    [(249.0, 1.05, 'aim reached'), (249.0, 2.0, 'met'), (251.0, 1.0, 'MISSED')],
)
def test_memory_is_judged_by_its_size_and_its_aim_by_its_growth(value, ratio, verdict):
    key = keys.BY_NAME['analysis_one_hour_rss_mb']
    result = Measured(value, 'MB', ratio, value / ratio, 7)
    assert (key.number(result), key.verdict(result)) == (value, verdict)
    assert (key.bound(key.must), key.bound(key.aim)) == ('≤ 250', 'flat')


def test_what_is_there_for_information_is_not_judged():
    key = keys.BY_NAME['bag_read_vs_rosbags']
    assert (key.verdict(measured(0.1)), key.bound(key.must)) == ('', '')


def test_every_key_is_measured_by_one_group():
    listed = [name for names in keys.GROUPS.values() for name in names]
    assert sorted(listed) == sorted(keys.BY_NAME)


@pytest.mark.parametrize(
    ('value', 'unit', 'text'),
    [
        (0.000233, 's', '233 µs'), (0.0514, 's', '51.4 ms'), (2.5, 's', '2.5 s'),
        (31234.0, 'rollouts/s', '31 234 rollouts/s'), (2330.4, 'steps/s', '2 330 steps/s'),
        (381.0, 'MB', '381 MB'),
    ],
)  # fmt: skip
def test_quantity(value, unit, text):
    assert table.quantity(value, unit) == text


def test_the_table_names_what_was_missed_and_why_and_what_was_not_measured():
    results = {'rollout_vs_c': asdict(measured(0.7)), **CONDITIONS}
    text = table.table(results)
    row = next(line for line in text.splitlines() if '`rollout_vs_c`' in line)
    assert '| **0.7** (0.7–0.7) | ≤ 0.6 | ≤ 0.25 | MISSED | 0.4, 20% |' in row
    assert '* `rollout_vs_c`: ' in text
    assert text.count('| not measured |') == len(keys.KEYS) - 1


def test_results_survive_json():
    results = json.loads(json.dumps({'help_vs_python': asdict(measured(1.5)), **CONDITIONS}))
    assert '**1.5** (1.5–1.5)' in table.table(results)


@pytest.mark.parametrize(
    ('ratio', 'load', 'code'), [(1.5, QUIET, 0), (4.5, QUIET, 1), (1.5, BUSY, 3), (4.5, BUSY, 3)]
)
def test_only_judges_and_writes_nothing(ratio, load, code, tmp_path, monkeypatch, capsys):
    results, readme = tmp_path / 'results.json', tmp_path / 'README.md'
    monkeypatch.setattr(run, 'RESULTS', results)
    monkeypatch.setattr(table, 'README', readme)
    found = measured(ratio, load=load)
    monkeypatch.setattr(run, 'measure', lambda names: (dict.fromkeys(names, found), {}))
    with pytest.raises(SystemExit) as end:
        run.main(['--only', 'help_vs_python'])
    assert end.value.code == code
    assert json.loads(capsys.readouterr().out)['help_vs_python']['ratio'] == ratio
    assert not [*tmp_path.iterdir()]


def test_a_benchmark_that_fails_is_named_and_does_not_cost_the_others(monkeypatch, capsys):
    def fails():
        raise ValueError('no\nreason')

    monkeypatch.setattr('bench_commands.command_line', lambda: {'help_vs_python': measured(1.5)})
    monkeypatch.setattr('bench_commands.sweep', fails, raising=False)
    found, missing = run.measure({'help_vs_python', 'sweep_10k_vs_c'})
    assert replace(found.pop('help_vs_python'), load=QUIET) == measured(1.5)
    assert not found
    assert missing == {'sweep_10k_vs_c': 'ValueError: no'}
    assert 'sweep_10k_vs_c: not measured: ValueError: no\n' in capsys.readouterr().err


def test_an_unknown_key_ends_with_two(capsys):
    with pytest.raises(SystemExit) as end:
        run.main(['--only', 'rollout_vs_d'])
    assert end.value.code == 2
    assert 'rollout_vs_c' in capsys.readouterr().err
