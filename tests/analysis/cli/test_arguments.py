"""The command line: what numbers, names and topics are taken, defaults, refusals, output."""

import argparse
import importlib
import io
import math
import re
import subprocess
import sys
from argparse import Namespace

import pytest

from auv_analysis import cli
from auv_analysis.cli.arguments import namespace, number, refuse_given, topic, whole
from auv_analysis.cli.main import main, parser
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.yaml_files import LARGEST


def taken(kind, text: str):
    """What a type makes of a text; its complaint where it refuses it."""
    try:
        return kind(text)
    except argparse.ArgumentTypeError as error:
        return str(error)


def test_defaults_are_those_that_the_help_names() -> None:
    unsaid = {}
    for name, command in parser().children.items():
        for action in command.arguments:
            default = action.default
            if default in (None, False, []) or default == argparse.SUPPRESS:
                continue
            told = (action.help or '').partition('default: ')[2]
            if not told:
                unsaid[name, action.option_strings[0]] = default
            elif default not in ('best', 'auto'):  # said in words
                assert told == (f'{default:g}' if isinstance(default, float) else str(default))
    assert unsaid == {
        ('watch', '--namespace'): '/', ('check-driver', '--namespace'): '/',
        ('watch', '--for'): math.inf,
    }  # fmt: skip


@pytest.mark.parametrize(
    ('bounds', 'texts'),
    [
        ({}, {'-1e3': -1000.0, f'{LARGEST}': LARGEST, f'-{LARGEST}': -LARGEST,
              'x': f'expected a finite number, at most {LARGEST:g}, found x'}),
        ({}, {text: f'expected a finite number, at most {LARGEST:g}, found {text}'
              for text in ('nan', 'inf', '-inf', f'{1.001 * LARGEST}')}),
        ({'above': 1.0, 'below': 3.0}, {'1.5': 1.5, **{
            text: f'expected a number above 1, below 3, found {text}'
            for text in ('1', '3', 'x')}}),
        ({'at_least': 1.0, 'at_most': 3.0, 'words': ' or max'}, {'1': 1.0, '3': 3.0, **{
            text: f'expected a number of at least 1, at most 3 or max, found {text}'
            for text in ('0.99', '3.01', 'max')}}),
    ],
)  # fmt: skip
def test_a_number_is_within_its_bounds(bounds, texts) -> None:
    assert {text: taken(number(**bounds), text) for text in texts} == texts


def test_a_whole_number_is_within_its_bounds() -> None:
    assert [whole(2, 4)('2'), whole(2, 4)('4'), whole(2)('999')] == [2, 4, 999]
    for text in ('1', '5', '2.5', 'two'):
        assert taken(whole(2, 4), text) == f'expected a whole number from 2 to 4, found {text}'
    assert taken(whole(2), '1') == 'expected a whole number from 2 on, found 1'


def test_names_are_those_of_ros() -> None:
    same = {'/': '/', 'auv1': '/auv1', '/auv1/': '/auv1', '/fleet/auv_2': '/fleet/auv_2'}
    assert {text: namespace(text) for text in same} == same
    assert [topic(text) for text in ('odom', '/auv1/odom')] == ['odom', '/auv1/odom']
    for text in ('1a', 'a/1b', 'a//b', 'a b'):
        assert taken(namespace, text) == f'expected a ROS namespace such as /auv1, found {text}'
        assert taken(topic, text).endswith(f'such as odom or /auv1/odom, found {text}')
    assert taken(topic, 'odom/').startswith('expected a ROS topic ')


def test_of_options_that_mean_nothing_the_given_ones_are_refused() -> None:
    options = Namespace(odometry=None, no_report=False, start=0.0)
    refuse_given(options, ('odometry', 'no_report'), 'runs', 'x')
    for name, given, option in (
        ('odometry', 'o', '--odom'), ('no_report', True, '--no-report'), ('start', 0.0, '--start'),
    ):  # fmt: skip
        setattr(options, name, given)
        with pytest.raises(InputError, match=re.escape(f'{option}: expected runs, found x')):
            refuse_given(options, (name,), 'runs', 'x')


@pytest.mark.parametrize(
    ('line', 'words'),
    [
        ('simulate case1 --hodl=zoh', 'an option of auv simulate (nearest: --hold), found --hodl'),
        ('simulate -- --hodl', '--hodl: expected '),
        ('simulate case1 --hold=foh', 'expected one of continuous, zoh (nearest: zoh), found foh'),
        ('check-driver --seconds 600.1', 'expected a number above 0, at most 600, found 600.1'),
        ('check-driver --expect-rate 10001', 'above 0, at most 10000, found 10001'),
        ('check-driver --expect-rate 0', 'found 0'),
        ('check-driver --speed 0.51', 'above 0, at most 0.5, found 0.51'),
        ('check-driver --speed 0', 'found 0'),
        ('check-driver --force 0', '--force: expected a number above 0, found 0'),
        ('check-driver --torque 0', '--torque: expected a number above 0, found 0'),
        ('check-driver --axis up', 'surge'),
        ('linearize case1 --delay -0.1', '--delay: expected a number of at least 0, found -0.1'),
        ('simulate case1 --out', 'expected one argument, found none; see auv simulate --help'),
        ('simulate', 'expected a valid command line, found: the following arguments are required'),
    ],
)  # fmt: skip
def test_a_complaint_is_one_line_that_says_what_is_expected(line, words, capsys) -> None:
    with pytest.raises(SystemExit) as ended:
        main(line.split())
    assert ended.value.code == 2
    (complaint,) = capsys.readouterr().err.splitlines()
    assert words in complaint


def test_options_on_their_border_and_abbreviated_are_taken() -> None:
    line = '--seconds 600 --expect-rate=1e4 --speed 0.5 --ax surge'
    found = parser().parse_args(['check-driver', *line.split()])
    assert (found.seconds, found.expect_rate, found.speed) == (600.0, 1e4, 0.5)
    assert found.axis == ['surge']
    assert parser().parse_args(['linearize', 'case1', '--delay', '0']).delay == 0.0


@pytest.mark.parametrize(('program', 'raised', 'last'), [
    ('bin/auv', KeyboardInterrupt(), 'interrupted'), ('bin/auv', ValueError('x'), 'ValueError: x'),
    ('pytest', KeyboardInterrupt(), 'KeyboardInterrupt'),
])  # fmt: skip
def test_a_ctrl_c_before_the_command_has_begun_is_one_line(program, raised, last, monkeypatch):
    monkeypatch.setattr(sys, 'argv', [program])
    monkeypatch.setattr(sys, 'excepthook', sys.__excepthook__)
    said = io.StringIO()
    monkeypatch.setattr(sys, 'stderr', said)
    importlib.reload(cli)
    sys.excepthook(type(raised), raised, None)
    assert said.getvalue() == f'{last}\n'


NOISY = """
import os
from types import SimpleNamespace
from auv_analysis.cli import main
def run(_):
    os.write(1, b'noise')
    return {'a': 1}
main._module = lambda _: SimpleNamespace(add_arguments=lambda _: None, run=run)
main.main(['info', '--json'])
"""


@pytest.mark.parametrize(('closed', 'errors'), [('', 'noise'), (' 2>&-', '')])
def test_a_json_document_has_standard_output_for_itself(closed: str, errors: str) -> None:
    """Also where a library in C prints to it, as Fast DDS does."""
    line = ['sh', '-c', f'"$0" -c "$1"{closed}', sys.executable, NOISY]
    done = subprocess.run(line, capture_output=True, text=True, check=True)
    assert done.stdout.endswith('{"a": 1}\n')
    assert done.stdout.removesuffix('{"a": 1}\n') == ('' if errors else 'noise')
    assert done.stderr == errors
