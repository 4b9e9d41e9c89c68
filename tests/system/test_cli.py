"""The installed `auv`: help, refusals in one line, and exactly one JSON document."""

import ctypes
import json
import os
import shutil
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psutil
import pytest
import yaml
from geometry_msgs.msg import WrenchStamped
from helpers.artists import captured, undrawn
from helpers.patience import patience
from nav_msgs.msg import Odometry
from rclpy.serialization import serialize_message

from auv_analysis import load_scenario
from auv_analysis.bag.metadata import Definition
from auv_analysis.bag.output import Storage
from auv_analysis.bag.ros2msg import schema_text
from auv_analysis.bag.writer import BagWriter
from auv_analysis.cli import main, scenario_runs
from auv_analysis.cli.main import COMMANDS
from auv_analysis.graph.node_parameters import node_parameters, parameter_file
from auv_analysis.output.folder import SWEEP, listed_in, paths_in, sha256_of, write_manifest
from auv_analysis.report.verdict import FAILED
from auv_dynamics.files.shipped import shipped

AUV = Path(sys.executable).with_name('auv')
WITHOUT_OUT = ('new', 'doctor', 'completion', 'watch', 'info', 'recover', 'check-vehicle')
REXROV = shipped('vehicles', 'rexrov').read_text(encoding='utf-8')
WRONG_LINES = {  # what is typed -> what the one line names
    '--jsn': '--jsn',
    'fly': 'fly',
    'simulte case1': 'nearest: simulate',
    'simulate case1 --hodl zoh': 'nearest: --hold',
    'params --controler gvc case1': 'nearest: --controller',
    'simulate case1 --controller gcv': 'nearest: gvc',
    'sweep case1_gain': 'nearest: case1_gains',
    'design rexrov --bound shift.xx=0:1': 'nearest: shift.x',
    'simulate': 'scenario',
    'simulate case1 case2': 'case2',
    'simulate case1 --colour red': '--colour',
    'simulate case1 --hold foh': '--hold',
    'simulate case1 --out': '--out',
    'simulate case9': 'case9',
    'simulate gone/case.yaml': 'gone/case.yaml',
    'simulate .': '.',
    'simulate case1 --controller pid': 'controllers',
    'simulate case1 --out taken': 'taken: --out',
    'simulate case1 --out taken/notes.md': 'taken/notes.md: --out',
    'simulate case1 --out taken/notes.md/x': 'taken/notes.md/x: --out',
    'run case1 --controller gvc --controller pid': 'controllers',
    'run case1 --domain-id text': '--domain-id',
    'run case1 --domain-id 102': '--domain-id',
    'study case1 --run --domain-id 102': '--domain-id',
    'run case1 --out taken': 'taken: --out',
    'watch --domain-id 102': '--domain-id',
    'watch --rate 0': '--rate',
    'watch --rate 31': '--rate',
    'watch --for -1': '--for',
    'watch --for nan': '--for',
    'analyze bag --gap inf': '--gap',
    'linearize rexrov --nu0 1e200 0 0 0 0 0': '--nu0',
    'check-vehicle lauv --speed nan': '--speed',
    'watch --vehicle gone': 'gone',
    'watch --namespace 1/a': '--namespace',
    'replay gone': 'gone',
    'replay gone --rate fast': '--rate',
    'replay gone --law cl': 'gone',
    'replay gone --overwrite': '--overwrite',
    'replay gone --law cl --start 0': '--start: expected no --law',
    'replay gone --law cl --topics odom': '--topics: expected no --law',
    'replay gone --law cl --force-commands': '--force-commands: expected no --law',
    'sweep': 'campaign',
    'sweep case9': 'case9',
    'sweep case1_gains --out taken': 'taken: --out',
    'sweep case1_gains --workers 0': '--workers',
    'sweep case1_gains --workers two': '--workers',
    'sweep case1_gains --executor ray': '--executor',
    'sweep case1_gains --executor threads --scheduler tcp://localhost:1': '--scheduler',
    'sweep case1_gains --scheduler tcp://localhost:1 --workers 2': '--workers',
    'sweep case1_gains --scheduler nowhere': '--scheduler',
    'design': 'vehicle',
    'design nautilus': 'nautilus',
    'design rexrov --scenario case9': 'case9',
    'design rexrov --reduce delta_xi.sideways': '--reduce',
    'design rexrov --bound shift.x': '--bound',
    'design rexrov --bound shift.x=a:b': '--bound',
    'design rexrov --bound shift.x=1:2': '--bound: shift.x',
    'design rexrov --out taken': 'taken: --out',
    'params case1': '--controller',
    'params case1 --controller pid': 'controllers',
    'params case1 --controller gvc --out taken/notes.md': 'taken/notes.md: --out',
    'params case1 --controller gvc --out taken/notes.md/x': 'taken/notes.md/x: --out',
    'params case1 --controller gvc --out taken --overwrite': 'taken: --out',
    'export-vehicle rexrov --out taken/notes.md': 'taken/notes.md: --out',
    'linearize rexrov --delay 0.1': '--delay: expected a scenario',
    'linearize rexrov --delay-from gone.json': '--delay-from: expected a scenario',
    'linearize rexrov --lag 0.1': '--lag: expected a scenario',
    'analyze': 'BAG',
    'analyze gone': 'gone',
    'analyze case1 --by nonsense': '--by: expected a sweep, found case1',
    'study case1 --run --hold continuous': '--hold: expected zoh with --run',
    'study case1 --composed': '--composed: expected --run',
    'analyze taken': 'taken',
    'analyze case1 gone.npz': 'gone.npz',
    'analyze case1 --out taken': 'taken: --out',
    'atlas nautilus': 'nautilus',
    'atlas --out taken': 'taken: --out',
    'atlas --only': 'VEHICLE',
    'info gone.mcap': 'gone.mcap',
    'info taken': 'taken',
    'info taken/notes.md': 'taken/notes.md',
    'analyze taken/notes.md': 'taken/notes.md',
}
INSTALLED = [  # of these, the ones that are also tried as the user runs them
    'fly', 'run case1 --out taken',
    *(pytest.param(line, marks=pytest.mark.long) for line in (
        'simulate case1 --hold foh', 'simulate case1 --out taken', 'info taken/notes.md',
        'run case1 --controller gvc --controller pid', 'sweep case1_gains --out taken',
    )),
]  # fmt: skip


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Working directory with one folder that is in use."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv('ROS_DOMAIN_ID', raising=False)
    (tmp_path / 'taken').mkdir()
    (tmp_path / 'taken' / 'notes.md').write_text('mine\n')
    return tmp_path


def _exit_code(*arguments: str) -> Any:
    try:
        main.main(list(arguments))
    except SystemExit as end:
        return end.code
    return 0


def _is_refusal(code: Any, out: str, err: str, name: str, folder: Path) -> None:
    lines = err.splitlines()
    assert (code, len(lines), out) == (2, 1, ''), err
    for word in ('expected', 'found', name):
        assert word in lines[0]
    assert [path.name for path in folder.iterdir()] == ['taken']
    assert (folder / 'taken' / 'notes.md').read_text() == 'mine\n'


@pytest.mark.parametrize('line', WRONG_LINES)
def test_wrong_command_line_is_refused_in_one_line(line, folder, capsys) -> None:
    code = _exit_code(*line.split())
    captured = capsys.readouterr()
    _is_refusal(code, captured.out, captured.err, WRONG_LINES[line], folder)


@pytest.mark.parametrize('line', INSTALLED)
def test_installed_command_refuses_and_leaves_no_process(line: str, folder: Path) -> None:
    mark = uuid.uuid4().hex  # inherited by whatever the command starts
    done = subprocess.run(
        [AUV, *line.split()], cwd=folder, capture_output=True, text=True, check=False,
        env={**os.environ, 'AUV_TEST_MARK': mark},
    )  # fmt: skip
    _is_refusal(done.returncode, done.stdout, done.stderr, WRONG_LINES[line], folder)
    assert not [process for process in psutil.process_iter() if _has(process, mark)]


def _has(process: psutil.Process, mark: str) -> bool:
    try:
        return process.environ().get('AUV_TEST_MARK') == mark
    except psutil.Error:
        return False


@pytest.mark.parametrize('arguments', [[], *([command] for command in COMMANDS)], ids=' '.join)
def test_help(arguments: list[str], capsys: pytest.CaptureFixture) -> None:
    assert _exit_code(*arguments, '--help') == 0
    text = capsys.readouterr().out
    assert text.startswith(' '.join(['usage: auv', *arguments]))
    words = [*COMMANDS] if not arguments else ['--json']
    writes = bool(arguments) and arguments[0] not in WITHOUT_OUT
    words = [*words, '--out', '--overwrite'] if writes else words
    assert all(word in text for word in words)


@pytest.mark.parametrize('options', [[], ['--real-time']])
def test_params_prints_the_parameter_file(options, folder, capsys) -> None:
    main.main(['params', 'case1', '--controller', 'gvc', *options])
    data = yaml.safe_load(capsys.readouterr().out)
    assert all(set(entry) == {'ros__parameters'} for entry in data.values())
    assert data['/**/controller_node']['ros__parameters']['law'] == 'gvc'
    for node in ('plant_node', 'controller_node'):
        assert data[f'/**/{node}']['ros__parameters']['lockstep'] is not bool(options)
    main.main(['params', 'case1', '--controller', 'gvc', *options, '--out', 'new/gvc.yaml'])
    assert yaml.safe_load((folder / 'new' / 'gvc.yaml').read_text()) == data
    main.main(['params', 'case1', '--controller', 'gvc', *options, '--json'])
    nodes = {name.rpartition('/')[2]: entry['ros__parameters'] for name, entry in data.items()}
    assert json.loads(capsys.readouterr().out) == nodes


def test_params_for_a_driver_know_neither_plant_nor_simulated_time(folder, capsys) -> None:
    main.main(['params', 'case1', '--controller', 'gvc', '--no-plant', '--out', 'driver.yaml'])
    assert 'controller_node: limits.wrench: expected' in capsys.readouterr().err
    data = yaml.safe_load((folder / 'driver.yaml').read_text())
    nodes = {name.rpartition('/')[2]: entry['ros__parameters'] for name, entry in data.items()}
    assert set(nodes) == {'setpoint_node', 'controller_node', 'analysis_node', 'recorder_node'}
    assert not any(values['use_sim_time'] for values in nodes.values())
    assert nodes['controller_node']['lockstep'] is False
    recorder = nodes['recorder_node']
    assert recorder['strict'] is False
    assert recorder['topics'] == ['odom', 'cmd_vel', 'cmd_accel', 'wrench', 'disturbance_estimate']
    attached = dict(entry.split('=') for entry in recorder['attachments'])
    assert attached['params.yaml'] == str(folder / 'driver.yaml')
    assert Path(attached['vehicle.yaml']).name == 'herman2018.yaml'
    assert 'wrench=2' in nodes['controller_node']['expected_subscribers']


def test_params_replace_an_earlier_file_where_asked_and_never_the_scenario(folder) -> None:
    Path('short.yaml').write_text(SHORT.replace('OFFSET', '0.5').replace('GAIN', '12'))
    for line, code in (
        ('gvc.yaml', 0), ('gvc.yaml', 2), ('gvc.yaml --overwrite', 0), ('short.yaml --overwrite', 2)
    ):  # fmt: skip
        given = 'params', 'short.yaml', '--controller', 'gvc', '--out', *line.split()
        assert _exit_code(*given) == code, line
    assert 'name: short' in Path('short.yaml').read_text()


SHORT = """
name: short
vehicle: herman2018_neutral
duration: 0.05
step: 0.01
controllers: {gvc: {law: gvc, k_D: GAIN, k_I: 1, Lambda: 0.8, Gamma: 60}}
setpoint: {surge: {offset: OFFSET}}
"""


@pytest.mark.parametrize(
    ('offset', 'options'),
    [('0.5', ('--no-report',)), ('0', ())],
    ids=['moving, without a report', 'at rest'],
)
def test_simulate_prints_one_document_and_leaves_its_files(offset, options, folder, capsys) -> None:
    Path('short.yaml').write_text(SHORT.replace('OFFSET', offset).replace('GAIN', '12'))
    with captured():
        assert _exit_code('simulate', 'short.yaml', '--json', *options) == 0
    summaries = json.loads(capsys.readouterr().out)
    assert list(summaries) == ['gvc']
    assert summaries['gvc']['samples'] == 6
    results = folder / 'runs' / 'short'
    assert json.loads((results / 'summary.json').read_text()) == summaries
    left = {'scenario.yaml', 'vehicle.yaml', 'gvc.npz', 'summary.json', 'manifest.json'}
    report = {'report.html', 'figures', 'numbers.parquet'}
    assert {path.name for path in results.iterdir()} == (left if options else left | report)
    assert {*paths_in(results)} == {*listed_in(results)}, 'else it could not be replaced'


def test_without_a_report_runs_are_compared_and_remarked_on_as_well(folder, capsys) -> None:
    slow = '60}, slow: {law: gvc, k_D: 6, k_I: 1, Lambda: 0.8, Gamma: 60}}'
    text = SHORT.replace('OFFSET', '0.5').replace('GAIN', '12').replace('60}}', slow)
    Path('two.yaml').write_text(text.replace('herman2018_neutral', 'bluerov2'))
    assert _exit_code('simulate', 'two.yaml', '--no-report') == 0
    said = capsys.readouterr().err
    assert 'against slow, gvc has ' in said
    for name in ('gvc', 'slow'):
        assert f'note: {name}: pitch (up to ' in said


def test_a_hold_that_actuators_do_not_take_is_refused_in_one_line(folder, capsys) -> None:
    text = SHORT.replace('OFFSET', '0.5').replace('GAIN', '12')
    Path('taken/short.yaml').write_text(f'{text}actuators: {{limit: 100.0}}\n')
    code = _exit_code('simulate', 'taken/short.yaml')
    captured = capsys.readouterr()
    _is_refusal(code, captured.out, captured.err, '--hold zoh', folder)


@pytest.mark.parametrize('option', [
    '--no-report', '--map x', '--odom x', '--law x', '--vehicle x', '--namespace x', '--wrench x',
    '--setpoint x', '--frames ned_fsd', '--twist-frame child', '--step 1', '--gap 1',
])  # fmt: skip
def test_what_is_of_runs_is_refused_with_a_sweep(option, folder, capsys) -> None:
    Path('taken', SWEEP).write_text('{}')
    code = _exit_code('analyze', 'taken', *option.split())
    captured = capsys.readouterr()
    _is_refusal(code, captured.out, captured.err, f'{option.split()[0]}: expected runs', folder)


def test_work_that_fails_ends_in_one_line_with_code_1(folder, capsys) -> None:
    Path('wild.yaml').write_text(SHORT.replace('OFFSET', '0.5').replace('GAIN', '-1.0e+5'))
    assert _exit_code('simulate', 'wild.yaml', '--json') == 1
    captured = capsys.readouterr()
    assert captured.out == ''
    assert len(captured.err.splitlines()) == 1
    assert 'short, gvc: the closed loop diverges' in captured.err


@pytest.fixture(scope='module')
def recording(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Write a bag of five steps at rest, with these attachments instead of the usual ones."""
    scenario = load_scenario('case1')
    parameters = node_parameters(scenario, 'gvc', bag=Path('gvc'))
    usual = {
        **scenario.attachments,
        'params.yaml': parameter_file(parameters, 'case1'),
    }

    def write(**attachments: str | None) -> Path:
        named = {name.replace('_', '.'): text for name, text in attachments.items()}
        kept = {k: text for k, text in {**usual, **named}.items() if text is not None}
        writer = BagWriter(tmp_path_factory.mktemp('bag') / 'gvc', kept, Storage('none'))
        odom, wrench = Odometry(child_frame_id='base_link_fsd'), WrenchStamped()
        odom.header.frame_id, wrench.header.frame_id = 'odom_ned', 'base_link_fsd'
        for topic, kind in (('/odom', 'nav_msgs/msg/Odometry'),
                            ('/wrench', 'geometry_msgs/msg/WrenchStamped')):  # fmt: skip
            writer.add_channel(Definition(topic, kind), schema_text(kind))
        for k in range(5):
            odom.header.stamp.nanosec = k * 10**7
            wrench.header.stamp = odom.header.stamp
            writer.write('/odom', k * 10**7, serialize_message(odom))
            writer.write('/wrench', k * 10**7, serialize_message(wrench))
        writer.close()
        return writer.path.parent

    return write


def test_info(recording, capsys) -> None:
    bag = recording()
    main.main(['info', str(bag)])
    text = capsys.readouterr().out
    for word in ('10 messages', '0.04 s', '/odom', 'nav_msgs/msg/Odometry', 'params.yaml'):
        assert word in text
    main.main(['info', str(bag), '--json'])
    document = json.loads(capsys.readouterr().out)
    assert document['topics']['/wrench'] == {
        'type': 'geometry_msgs/msg/WrenchStamped',
        'messages': 5,
    }
    assert document['files'] == ['gvc_0.mcap']
    assert (document['candidates'], document['mapping']) == ({}, '')
    assert document['attachments'] == ['params.yaml', 'scenario.yaml', 'vehicle.yaml']
    assert document['notes'] == []


def test_info_of_every_beginning_of_a_bag_says_that_it_is_one(recording, capsys, tmp_path) -> None:
    whole = next(recording().glob('*.mcap')).read_bytes()
    path = tmp_path / 'cut.mcap'
    end = len(whole) - 37  # where the footer begins, the last record
    for length in [*range(40), *range(40, end, 251), end]:
        path.write_bytes(whole[:length])
        code = _exit_code('info', str(path), '--json')
        captured = capsys.readouterr()
        if code == 0:
            assert 'cut.mcap: ' in json.loads(captured.out)['notes'][0], length
        else:
            lines = captured.err.splitlines()
            assert (code, len(lines), captured.out) == (2, 1, ''), length
            assert str(path) in lines[0]


def test_info_of_a_damaged_bag_says_so(recording, capsys, tmp_path) -> None:
    data = bytearray(next(recording().glob('*.mcap')).read_bytes())
    data[data.rindex(b'odom_ned') + 200] ^= 1  # in a covariance: only the chunk's CRC can tell
    path = tmp_path / 'bent.mcap'
    path.write_bytes(data)
    main.main(['info', str(path), '--json'])
    assert 'damaged' in ' '.join(json.loads(capsys.readouterr().out)['notes'])


def _parameters(**changes: Any) -> str:
    parameters = node_parameters(load_scenario('case1'), 'gvc', bag=Path('gvc'))
    for place, value in changes.items():
        node, key = place.split('__')
        parameters[f'{node}_node'][key.replace('gains_', 'gains.')] = value
    return parameter_file(parameters, 'changed')


ATTACHED = {  # what is wrong -> attachment, its text
    'vehicle: no YAML': ('vehicle_yaml', '}{'),
    'vehicle: tab': ('vehicle_yaml', 'name: x\n\tmass: 1\n'),
    'vehicle: scalar': ('vehicle_yaml', '5'),
    'vehicle: empty': ('vehicle_yaml', ''),
    'vehicle: none': ('vehicle_yaml', None),
    'vehicle: number as key': ('vehicle_yaml', '1: 2\n'),
    'vehicle: python tag': ('vehicle_yaml', 'name: !!python/object/apply:os.getcwd []\n'),
    'vehicle: doubled key': ('vehicle_yaml', f'{REXROV}name: x\n'),
    'law unknown': ('params_yaml', _parameters(controller__law='pid')),
    'law a number': ('params_yaml', _parameters(controller__law=5)),
    'law a list': ('params_yaml', _parameters(controller__law=['gvc'])),
    'gain of 5': ('params_yaml', _parameters(controller__gains_k_D=[1.0] * 5)),
    'gain a word': ('params_yaml', _parameters(controller__gains_k_D='x')),
    'gain NaN': ('params_yaml', _parameters(controller__gains_k_D=[float('nan')])),
    'gain unknown': ('params_yaml', _parameters(controller__gains_k_P=[1.0])),
    'step a word': ('params_yaml', _parameters(plant__step='x')),
    'step negative': ('params_yaml', _parameters(plant__step=-1.0)),
    'step NaN': ('params_yaml', _parameters(plant__step=float('nan'))),
    'bag a number': ('params_yaml', _parameters(recorder__bag=5)),
}  # fmt: skip


@pytest.mark.parametrize('what', ATTACHED)
def test_analyze_refuses_a_bag_with_a_bad_attachment(what, recording, folder, capsys) -> None:
    name, text = ATTACHED[what]
    bag = recording(**{name: text})
    code = _exit_code('analyze', str(bag), '--out', str(folder / 'out'))
    captured = capsys.readouterr()
    _is_refusal(code, captured.out, captured.err, name.replace('_', '.'), folder)
    assert str(bag) in captured.err
    assert 'is not of type' not in captured.err  # jsonschema's words, not ours


@pytest.fixture
def stopped(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """Folders that a command asked for; it ends, all well, where the summaries would begin."""
    from auv_analysis.output import folder

    asked: list[Path] = []
    made = folder.results_folder
    monkeypatch.setattr(
        folder, 'results_folder', lambda out, **options: asked.append(out) or made(out, **options)
    )
    monkeypatch.setattr(scenario_runs, 'summarize', lambda *_, **__: sys.exit(0))
    return asked


@pytest.mark.parametrize(
    'text', ['name: ../../evil', 'name: /evil', 'name: a/b', 'name: 5', 'name: [a]', 'name:', '}{']
)
def test_analyze_writes_below_runs_whatever_a_bag_says(text, recording, folder, stopped) -> None:
    assert _exit_code('analyze', str(recording(scenario_yaml=text))) in (0, 2)
    assert all(out.parent == Path('runs') for out in stopped)
    assert {path.name for path in folder.iterdir()} <= {'taken', 'runs'}


@pytest.mark.parametrize('out', ['result', 'result/gvc', 'result/gvc/..'])
@pytest.mark.parametrize('given', ['result/gvc', 'result/gvc/gvc_0.mcap'])
@pytest.mark.usefixtures('stopped')
def test_analyze_keeps_the_bags_that_it_reads(given, out, recording, folder) -> None:
    bag = shutil.copytree(recording(), folder / 'result' / 'gvc')
    (bag / 'params.yaml').write_text(_parameters())
    files = {str(path.relative_to(folder / 'result')): sha256_of(path) for path in bag.iterdir()}
    write_manifest(folder / 'result', files)
    before = {path.name: path.read_bytes() for path in bag.iterdir()}
    assert _exit_code('analyze', given, '--out', out, '--overwrite') in (0, 2)
    assert {path.name: path.read_bytes() for path in bag.iterdir()} == before


@pytest.mark.parametrize('cut', [3, 20, 100])
def test_analyze_refuses_messages_that_cannot_be_decoded(cut, folder, capsys) -> None:
    writer = BagWriter(folder / 'taken' / 'gvc', {}, Storage('none'))
    kind = 'nav_msgs/msg/Odometry'
    writer.add_channel(Definition('/odom', kind), schema_text(kind))
    writer.write('/odom', 0, serialize_message(Odometry())[:cut])
    writer.close()
    code = _exit_code('analyze', 'taken/gvc')
    captured = capsys.readouterr()
    _is_refusal(code, captured.out, captured.err, '/odom', folder)


def test_analyze_refuses_a_topic_of_another_type(folder, capsys) -> None:
    writer = BagWriter(folder / 'taken' / 'gvc', {}, Storage('none'))
    kind = 'geometry_msgs/msg/WrenchStamped'
    writer.add_channel(Definition('/odom', kind), schema_text(kind))
    writer.write('/odom', 0, serialize_message(WrenchStamped()))
    writer.close()
    code = _exit_code('analyze', 'taken/gvc')
    captured = capsys.readouterr()
    _is_refusal(code, captured.out, captured.err, kind, folder)


def test_a_controller_that_diverges_leaves_the_others_their_report(folder, capsys) -> None:
    with undrawn():
        line = 'simulate', 'case1_lauv', '--hold', 'zoh', '--out', 'lauv', '--json'
        assert _exit_code(*line) == 1
    said = capsys.readouterr()
    errors = said.err.splitlines()
    assert json.loads(said.out) == json.loads(Path('lauv/summary.json').read_text())
    assert errors[-1] == 'case1_lauv, cl: the closed loop diverges, not finite from t = 0.27 s'
    summaries = json.loads(Path('lauv/summary.json').read_text())
    assert summaries.keys() == {'gvc'}
    assert summaries['gvc']['law'] == 'gvc'
    assert summaries['gvc']['notes'] == [f'{FAILED}: {errors[-1]}']
    assert Path('lauv/report.html').exists()


def test_of_several_that_fail_the_first_is_named(folder, monkeypatch, capsys) -> None:
    tried = []

    def diverge(_scenario: object, name: str, _hold: str) -> None:
        tried.append(name)
        raise ArithmeticError(f'{name} diverges')

    monkeypatch.setattr(scenario_runs, 'simulate', diverge)
    assert _exit_code('simulate', 'case1') == 1
    assert capsys.readouterr().err.splitlines()[-1] == 'gvc diverges'
    tried.clear()
    asked = [word for name in ('cl', 'gvc', 'cl') for word in ('--controller', name)]
    assert _exit_code('simulate', 'case1', '--out', 'asked', *asked) == 1
    assert tried == ['cl', 'gvc']
    assert capsys.readouterr().err.splitlines()[-1] == 'cl diverges'


CALLBACK = ctypes.CFUNCTYPE(None)


def _dropped() -> None:
    signal.raise_signal(signal.SIGINT)  # raised in a callback of C, where Python drops it


def test_interrupt_that_python_drops_ends_the_command(monkeypatch, capsys) -> None:
    def command(_: object) -> dict:
        CALLBACK(_dropped)()
        limit = time.monotonic() + patience(30)
        while time.monotonic() < limit:
            time.sleep(0.01)
        return {}

    monkeypatch.setattr('auv_analysis.cli.doctor.run', command)
    assert _exit_code('doctor') == 1
    assert capsys.readouterr().err == 'interrupted\n'


def test_a_reader_that_has_gone_is_no_error_to_be_read(monkeypatch, capsys) -> None:
    read, write = os.pipe()
    os.close(read)
    with os.fdopen(write, 'w') as broken:  # closed, as at the end, it writes what is left
        monkeypatch.setattr(sys, 'stdout', broken)
        assert _exit_code('params', 'case1', '--controller', 'gvc') == 1
    assert capsys.readouterr().err == ''


@pytest.mark.parametrize('error', [OSError(28, 'No space left on device', 'x/y'), OSError('odd')])
def test_full_disk_ends_in_one_line(error, monkeypatch, capsys) -> None:
    def command(_: object) -> dict:
        raise error

    monkeypatch.setattr('auv_analysis.cli.simulate.run', command)
    assert _exit_code('simulate', 'case1') == 1
    text = error.strerror or str(error)
    (line,) = capsys.readouterr().err.splitlines()
    assert text in line


@pytest.mark.long
def test_interrupt_ends_simulate_whenever_it_comes(folder) -> None:
    command = [sys.executable, '-m', 'auv_analysis.cli.main', 'simulate', 'case1', '--overwrite']
    begun = time.monotonic()
    subprocess.run(command, check=True, capture_output=True)
    whole = time.monotonic() - begun
    for i in range(1, 40):
        process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        try:
            process.wait(0.3 + i / 40 * whole)
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGINT)
            _, errors = process.communicate(timeout=patience(60))
            # with -m, Python ends by the signal where that came inside of a text that is executed
            assert process.returncode in (1, -signal.SIGINT) or i > 34, errors  # or at its end
            assert 'Traceback' not in errors
            assert json.loads((folder / 'runs/case1/summary.json').read_text())
