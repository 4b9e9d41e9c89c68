"""What `auv check-vehicle` and `auv linearize` print: each number under its head."""

import io
from itertools import count
from types import SimpleNamespace as Made

import pytest
from rich.console import Console

from auv_analysis.report.results import Results, Table
from auv_analysis.studies import check_vehicle
from auv_analysis.studies.linearize import modes as linearize
from auv_analysis.studies.sweep import report as sweep
from auv_analysis.studies.tune import report as tune

DOFS = ('surge', 'sway', 'heave', 'roll', 'pitch', 'yaw')


class Printed:
    """Tables and lines, in their order, of what a function prints."""

    def __init__(self, monkeypatch, module, approved):
        self.tables: list[Table] = []
        self._file = io.StringIO()
        self.out = Console(file=self._file, width=400)
        monkeypatch.setattr(module, 'terminal', self._keep)
        approved.add(self)

    def __iter__(self):
        return iter(self.lines)

    def _keep(self, table: Table) -> str:
        self.tables.append(table)
        return ''

    @property
    def lines(self) -> list[str]:
        return [line for line in self._file.getvalue().splitlines() if line]

    def rows(self, place: int) -> list[dict[str, object]]:
        """Head with its unit -> number, or words."""
        table = self.tables[place]
        heads = [
            f'{head.label}, {head.unit}' if head.unit else head.label for head in table.columns
        ]
        return [
            {h: c.text if c.value is None else c.value for h, c in zip(heads, row, strict=True)}
            for row in table.rows
        ]


def _vehicle(numbers) -> dict:
    def six() -> list[float]:
        return [next(numbers) for _ in DOFS]

    mode = {'pole': [-0.5, 0.25], 'mostly': 'sway', 'time_constant': 2.5}
    return {
        'name': 'v', 'source': 'made [n.d.]', 'M': [six() for _ in DOFS], 'N': six(),
        'inertia': {'eigenvalues': six(), 'condition_number': next(numbers)},
        'statement': 'S', 'structural_zeros': {'delta_xi': ['yaw'], 'delta_pi': []},
        'couplings': [
            {'from': 'roll', 'to': 'sway', 'delta_xi': -0.125, 'unit': 'm/s per rad/s'},
            {'from': 'sway', 'to': 'yaw', 'delta_pi': 3.5, 'unit': 'N m per N'},
        ],
        'hydrostatics': {
            'weight': 101.5, 'buoyancy': 99.25, 'difference': 2.25, 'difference_percent': 2.27,
            'metacentric_height': 0.055, 'moment_when_level': [1.5, -2.5],
            'modes': {
                dof: {'eigenvalue': sign * next(numbers), 'natural_frequency': next(numbers),
                      'period': next(numbers)}
                for dof, sign in (('roll', 1.0), ('pitch', -1.0))
            },
        },
        'damping': {
            'time_constants': [{'mostly': 'yaw', 'rate': 0.7, 'time_constant': 1.43}],
            'linear_symmetric_eigenvalues': [4.0, 8.0],
        },
        'cruise': {'speed': 1.5, 'speed_source': 'given', 'modes': [mode], 'verdict': 'unstable',
                   'mostly': 'yaw', 'hint': ''},
        'thrusters': {
            'names': ['T1', 'T2'], 'rank': 5, 'rotors': [],
            'largest': {dof: [-next(numbers), next(numbers)] for dof in DOFS[:5]} | {'yaw': None},
            'unactuated': {'yaw': ['sway', 'roll'], 'heave': []},
        },
        'sampling': {
            law: {key: next(numbers) for key in ('k_D', 'rate', 'rings_above', 'unstable_above')}
            | {'mostly': law} for law in ('cl', 'gvc')
        },
        'warnings': ['odd'],
    }  # fmt: skip


def test_a_vehicle_that_is_checked(monkeypatch, approved) -> None:
    printed = Printed(monkeypatch, check_vehicle, approved)
    numbers = (101.0 + k for k in count())
    document = _vehicle(numbers)
    check_vehicle.print_check(document, printed.out)
    assert printed.rows(0) == [
        {'': dof, **dict(zip(DOFS, row, strict=True)), 'N': N}
        for dof, row, N in zip(DOFS, document['M'], document['N'], strict=True)
    ]
    assert printed.rows(1) == [{'of': 'roll', 'in': 'sway', '': '-0.125', 'unit': 'm/s per rad/s'}]
    assert printed.rows(2) == [{'of': 'sway', 'in': 'yaw', '': '+3.5', 'unit': 'N m per N'}]
    assert printed.rows(3) == [
        {'': dof, 'eigenvalue, 1/s2': mode['eigenvalue'],
         'frequency, rad/s': mode['natural_frequency'], 'period, s': mode['period']}
        for dof, mode in document['hydrostatics']['modes'].items()
    ]  # fmt: skip
    assert printed.rows(4) == [{'mostly': 'yaw', 'rate, 1/s': 0.7, 'time constant, s': 1.43}]
    assert printed.rows(5) == [
        {'mostly': 'sway', 'pole, 1/s': '-0.5 ± 0.25i', 'time constant, s': 2.5}
    ]
    largest = document['thrusters']['largest']
    assert printed.rows(6) == [
        {'': dof, 'backward': pair[0] if pair else '–', 'forward': pair[1] if pair else '–'}
        for dof, pair in largest.items()
    ]
    assert printed.rows(7) == [
        {'law': law, 'mostly': law, 'k_D': entry['k_D'], 'rate, 1/s': entry['rate'],
         'rings above, s': entry['rings_above'], 'unstable above, s': entry['unstable_above']}
        for law, entry in document['sampling'].items()
    ]  # fmt: skip
    assert len(printed.tables) == 8
    for line in (
        'v: made [n.d.]', f'condition number {document["inertia"]["condition_number"]:.0f}',
        'zero in every motion: yaw', 'zero in every motion: none',
        'weight 101.5 N, buoyancy 99.2 N: +2.25 N (+2.27 %); metacentric height 0.055 m',
        'not level at rest: 1.5 N m in roll, −2.5 N m in pitch',
        'unstable in pitch: the vehicle turns over',
        'eigenvalues of the symmetric part of linear D: 4, 8',
        'poles straight ahead at 1.5 m/s (--speed)',
        'unstable at 1.5 m/s without control: it leaves straight motion, in yaw first',
        '2 thrusters, T has rank 5: largest wrench, N, N m',
        'yaw cannot be actuated apart from sway and roll', 'warning: odd',
    ):  # fmt: skip
        assert any(line in shown for shown in printed.lines), line
    assert sum('turns over' in line for line in printed.lines) == 1
    eigenvalues = ', '.join(f'{x:.0f}' for x in document['inertia']['eigenvalues'])
    assert any(line.startswith(f'eigenvalues {eigenvalues}; ') for line in printed.lines)


def test_poles_of_models(monkeypatch, approved) -> None:
    printed = Printed(monkeypatch, linearize, approved)
    modes = [
        {'pole': [0.5, 0.25], 'damping_ratio': 0.1234, 'natural_frequency': 0.2345,
         'time_constant': 0.3456, 'mostly': 'roll', 'part': 0.4},
        {'pole': [0.0, 0.0], 'damping_ratio': None, 'natural_frequency': 0.6, 'time_constant': None,
         'mostly': 'yaw', 'part': 0.9},
        {'pole': [-3.0, 0.0], 'damping_ratio': 1.0, 'natural_frequency': 3.0, 'time_constant': 0.33,
         'mostly': 'sway', 'part': 1.0},
    ]  # fmt: skip
    model = {'modes': modes, 'states': list('abcd'), 'stability': 'unstable', 'drift': [0.0, -1e-3]}
    still = model | {'modes': modes[2:], 'stability': 'asymptotically stable', 'drift': [1e-12, 0]}
    document = {'models': {'cl': model, 'open': still}, 'left_out': ['delay', 'noise']}
    linearize.print_poles(document, printed.out)
    assert printed.rows(0) == [
        {'pole, 1/s': text, 'damping': ratio, 'frequency, rad/s': omega, 'time constant, s': time,
         'mostly': dof, 'part, %': part}
        for text, ratio, omega, time, dof, part in (
            ('0.5 ± 0.25i', 0.1234, 0.2345, 0.3456, 'roll', 40.0),
            ('0', '–', 0.6, '–', 'yaw', 90.0), ('-3', 1.0, 3.0, 0.33, 'sway', 100.0),
        )
    ]  # fmt: skip
    assert printed.lines == [
        'cl: 4 states, unstable, 1 of its 3 modes grow, 1 of its 3 modes neither grow nor decay; '
        'the point moves: it turns while it is inclined',
        'open: 4 states, asymptotically stable', 'not in these models: delay, noise',
    ]  # fmt: skip


def test_margins_of_controllers(monkeypatch, approved) -> None:
    printed = Printed(monkeypatch, linearize, approved)
    axes = [
        {'axis': dof, 'gain_margin_db': 10.0 + k, 'phase_margin': 20.0 + k,
         'delay_margin': 30.25 + k, 'crossover': 40.25 + k, 'value': 50.25 + k,
         'largest': 60.25 + k}
        for k, dof in enumerate(DOFS)
    ]  # fmt: skip
    found = {'axes': axes, 'period': 0.01, 'delay': 0.02, 'lag': 0.03, 'stable': True,
             'disk_margin': 1.0, 'together': 2.5, 'gain': 'k_D'}  # fmt: skip
    unknown = found | {'disk_margin': None, 'together': None}
    gvc = found | {'stable': False, 'together': 0.0}
    linearize.print_margins({'cl': found, 'gvc': gvc, 'smc': unknown}, printed.out)
    assert printed.rows(0) == [
        {'axis': row['axis'], 'gain, dB': row['gain_margin_db'], 'phase, deg': row['phase_margin'],
         'delay, s': row['delay_margin'], 'crossover, rad/s': row['crossover'],
         'velocity gain': row['value'], 'at most': row['largest']}
        for row in axes
    ]  # fmt: skip
    lines = printed.lines
    held = 'when held with period 0.01 s, delay 0.02 s, lag 0.03 s; opened axis by axis'
    assert (lines[0], lines[3]) == (f'cl: stable {held}', f'gvc: UNSTABLE {held}')
    assert lines[1] == 'disk margin 1: 9.54 dB either way, or 53.1 deg, in all axes at once'
    assert lines[2] == 'all of k_D times 2.50 keeps 6 dB and 45 deg on every axis'
    assert lines[5] == 'all of k_D times no factor keeps 6 dB and 45 deg on every axis'
    assert lines[6:] == [f'smc: stable {held}']


@pytest.mark.parametrize(('alpha', 'decibel'), [(0.5, '4.44'), (2.0, 'inf'), (2.5, 'inf')])
def test_a_disk_margin_in_decibels(alpha: float, decibel: str) -> None:
    assert f': {decibel} dB either way' in linearize.disk_sentence(alpha)


def test_a_sweep_prints_three_measures_of_each_controller(monkeypatch, capsys, approved) -> None:
    printed = Printed(monkeypatch, sweep, approved)
    names = ('overall.velocity_error.settling_time', 'overall.velocity_error.rms.linear',
             'overall.effort.rms.linear', 'kinetic_energy.mean')  # fmt: skip
    columns = ('low', 'quarter', 'median', 'three_quarters', 'high', 'known', 'rows')
    rows = [
        {'figure': name, 'controller': controller, 'label': f'label {k}', 'unit': f'u{k}'}
        | {column: 100.0 * k + 10 * j + i for i, column in enumerate(columns)}
        for k, name in enumerate(names) for j, controller in enumerate(('gvc', 'cl'))
    ]  # fmt: skip
    analysis = Made(sweep=Made(rows=7, planned=9), notes=['odd'], tables={'quantiles': rows})
    sweep._show(analysis)
    heads = {'controller': 'controller', 'measure': 'label', '5 %': 'low', 'median': 'median',
             '95 %': 'high', 'unit': 'unit', 'exists in': 'known', 'of': 'rows'}  # fmt: skip
    assert printed.rows(0) == [{h: row[key] for h, key in heads.items()} for row in rows[:6]]
    said = capsys.readouterr().err
    approved.add(said.splitlines())
    assert 'note: not finished, 7 of 9 rows are there' in said
    assert 'note: odd' in said


def test_a_tuning_prints_what_each_controller_costs(monkeypatch, capsys, approved) -> None:
    printed = Printed(monkeypatch, tune, approved)
    measures = {name: 10.0 * k + 1 for k, name in enumerate(tune.COSTS)}
    entries = {
        'gvc': {'law': 'gvc', 'measures': measures, 'equality': 0.0},
        'cl_tuned': {'law': 'cl', 'structure': 'mass', 'equality': -0.25, 'price': -3.0,
                     'measures': {name: 100 + value for name, value in measures.items()}},
    }  # fmt: skip
    comparisons = [
        {'controller': 'cl_tuned', 'measure': 'effort', 'against': 'gvc', 'ratio': 7.0},
        {'controller': 'cl_tuned', 'measure': 'weighted_error', 'against': 'gvc', 'ratio': 0.5},
        {'controller': 'cl_tuned', 'measure': 'weighted_error', 'against': 'other', 'ratio': 9.0},
    ]
    facts = {
        'controllers': entries, 'monte_carlo': {'comparisons': comparisons}, 'reference': 'gvc',
        'index': 'weighted_error', 'equal': 'effort', 'verdict': [{'text': 'It is so.'}],
    }  # fmt: skip
    request = Made(index='weighted_error')
    tune.print_tuning(Made(results=Results('tune', facts), request=request))
    (gvc, cl) = printed.rows(0)
    assert gvc == {
        'controller': 'gvc', 'structure': 'as given', 'error, J': measures['weighted_error'],
        'effort, J/s²': measures['effort'], 'equality, %': 0.0,
        'settled, s': measures['settling'], 'draws': '–',
    }  # fmt: skip
    assert cl == {
        'controller': 'cl_tuned', 'structure': 'mass', 'error, J': 100 + measures['weighted_error'],
        'effort, J/s²': 100 + measures['effort'], 'equality, %': -25.0,
        'settled, s': 100 + measures['settling'], 'draws': 0.5,
    }  # fmt: skip
    said = capsys.readouterr().err
    approved.add(said.splitlines())
    assert 'It is so.' in said
    table = tune.controllers_table(Results('tune', facts | {'equal': 'error'}))
    assert table.rows[1][-1].value == 7.0, 'of equal error it is the effort that counts'
