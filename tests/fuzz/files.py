"""Targets that read files: each input is understood, or refused with one line."""

import contextlib
import io
import os
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from helpers.foreign_vehicles import BLUEROV2, REXROV, URDF, sdf
from helpers.made_messages import ODOMETRY, Bag, odometry, serialized, stamped
from watchman import playground, watched

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.cli import main
from auv_analysis.graph.node_parameters import node_parameters, parameter_file
from auv_analysis.replay.open_loop import open_loop, recorded_loop
from auv_analysis.replay.played_bag import LATEST, index_bag, messages
from auv_analysis.replay.selection import ReplaySettings, select
from auv_dynamics.files.errors import FailedError, InputError
from auv_dynamics.vehicle.vehicle_file import load_vehicle

ROOT = Path(__file__).resolve().parents[2]
TOPICS = {
    '/twist': 'Twist', '/cmd_vel': 'Twist', '/cmd_accel': 'Accel', '/wrench': 'Wrench',
    '/disturbance': 'Wrench', '/disturbance_estimate': 'Wrench',
}  # fmt: skip
EXPECTED = (InputError, FailedError, ArithmeticError)
STEPS = 60  # that a scenario is simulated for


class CrashError(AssertionError):
    """Something ended without a message."""


def shipped(folder: str) -> list[Path]:
    """Files that are shipped in a folder of config/."""
    return sorted((ROOT / 'config' / folder).glob('*.yaml'))


def dumped(data: Any) -> bytes:
    """A file of nested mappings and lists, as far as YAML can say it."""
    return yaml.safe_dump(data, sort_keys=False).encode('utf-8', 'surrogatepass')


def command(*arguments: str) -> int:
    """Run `auv` in this process; its exit code.

    Raises
    ------
    CrashError : another code than 0, 1 and 2, or no line that says why

    """
    said, printed = io.StringIO(), io.StringIO()
    try:
        with contextlib.redirect_stderr(said), contextlib.redirect_stdout(printed):
            main.main(list(arguments))
        return 0
    except SystemExit as error:
        code = error.code
    lines = [line for line in said.getvalue().splitlines() if line.strip()]
    if code not in (1, 2) or not lines:
        raise CrashError(f'exit code {code}, said {lines}')
    if code == 2 and len(lines) != 1:
        raise CrashError(f'wrong input is one line, found {lines}')
    return int(code)


def understood(read: Any, *arguments: Any) -> Any:
    """What a function gives, or None where it refuses with one line."""
    try:
        return read(*arguments)
    except EXPECTED as error:
        if not str(error).strip() or len(str(error).splitlines()) != 1:
            raise CrashError(f'a refusal is one line, found {str(error)!r}') from error
        return None


def try_vehicle(text: bytes) -> str:
    """A vehicle file."""
    with playground() as folder:
        path = folder / 'vehicle.yaml'
        path.write_bytes(text)
        with watched(folder):
            vehicle = understood(load_vehicle, path)
            if vehicle is None:
                return 'refused'
            command('check-vehicle', str(path), '--json')
            nu = np.array([0.5, -0.2, 0.1, 0.05, -0.1, 0.2])
            rate = vehicle.forward_dynamics(np.zeros(6), nu, np.ones(6))
            if not np.all(np.isfinite(rate)):
                raise CrashError(f'an accepted vehicle accelerates by {rate}')
            return 'accepted'


def try_scenario(text: bytes) -> str:
    """A scenario file; short ones are simulated."""
    with playground() as folder:
        path = folder / 'scenario.yaml'
        path.write_bytes(text)
        with watched(folder):
            scenario = understood(load_scenario, path)
            if scenario is None:
                return 'refused'
            for name in scenario.controllers:
                understood(lambda n=name: node_parameters(scenario, n, bag=folder / 'bag'))
            if scenario.steps > STEPS:
                return 'accepted'
            for name in scenario.controllers:
                run = understood(simulate, scenario, name, 'zoh')
                if run is not None and not np.all(np.isfinite(run.tau)):
                    raise CrashError(f'{name}: a wrench that is not finite')
                if run is not None:
                    understood(summarize, run)
            return 'simulated'


def try_bag(data: bytes) -> str:
    """A bag: read whole and in blocks, listed, played, analysed, recovered."""
    from auv_analysis.bag.load import load_run, open_bag

    with playground() as folder:
        bag = folder / 'bag'
        bag.mkdir()
        file = bag / 'bag_0.mcap'
        file.write_bytes(data)
        os.utime(file, (0, 0))  # nobody writes it any more, which a repair would wait to see
        with watched(folder):
            run = understood(load_run, bag)
            understood(lambda: summarize(open_bag(bag, whole=64).run))
            codes = [command('info', str(bag), '--json')]
            understood(try_replay, bag)
            codes.append(command('analyze', str(bag), '--json', '--no-report', '--out', 'results'))
            codes.append(command('recover', str(bag), '--json'))
            understood(load_run, bag)
            shutil.rmtree('results', ignore_errors=True)
            left = {entry.name for entry in folder.iterdir()}
            if left != {'bag'}:
                raise CrashError(f'files beside the bag: {left}')
            return 'refused' if run is None else 'read' if max(codes) == 0 else 'partly'


def try_costly_bag(data: bytes) -> str:
    """A small bag that declares very much; each command has the limits of an input."""
    with playground() as folder:
        file = folder / 'bag_0.mcap'
        file.write_bytes(data)
        os.utime(file, (0, 0))
        codes = []
        for name in ('info', 'analyze', 'recover'):
            with watched(folder):
                codes.append(command(name, str(file), '--json'))
        return ' '.join(map(str, codes))


def try_replay(bag: Path) -> None:
    """Read what a replay would publish, and let a law answer what was recorded."""
    index = index_bag(bag)
    selection = select(index, ReplaySettings(), lambda name: name)
    for message in messages(index, selection.names, 0, LATEST):
        if not 0 <= message.ns <= LATEST:
            raise CrashError(f'a message at {message.ns} ns')
    answers = open_loop(recorded_loop(bag), 'cl', {'k_D': 12.0, 'k_I': 1.0})
    if not np.all(np.isfinite(answers.tau)):
        raise CrashError('a wrench that is not finite')


IMPORTED = {'.yaml': REXROV, '.urdf': URDF, '.sdf': sdf(), '.m': BLUEROV2}
SAID = '--inertia-reference', 'co', '--gravity', '9.81', '--products', 'integral'


def try_import(data: bytes, suffix: str, *, told: bool) -> str:
    """A vehicle of another system; what comes of it is a vehicle file that can be used."""
    with playground() as folder:
        path, out = folder / f'theirs{suffix}', folder / 'vehicle.yaml'
        path.write_bytes(data)
        with watched(folder):
            code = command('import-vehicle', str(path), '--out', str(out), *(SAID if told else ()))
            if code:
                if out.exists():
                    raise CrashError('refused, and yet a file was written')
                return 'refused'
            rate = load_vehicle(out).forward_dynamics(np.zeros(6), np.ones(6), np.ones(6))
            if not np.all(np.isfinite(rate)):
                raise CrashError(f'an imported vehicle accelerates by {rate}')
            return 'accepted'


def try_text(data: bytes) -> str:
    """Bytes as a vehicle file and as a scenario file."""
    return f'{try_vehicle(data)}/{try_scenario(data)}'


def texts() -> list[bytes]:
    """Shipped vehicle and scenario files."""
    return [path.read_bytes() for path in (*shipped('vehicles'), *shipped('scenarios'))]


def bags() -> list[bytes]:
    """Short bags with all that `auv analyze` asks for: compressed, and not even in chunks."""
    scenario = load_scenario('case1')
    parameters = node_parameters(scenario, 'gvc', bag=Path('gvc'), vehicle='vehicle.yaml')
    attached = {**scenario.attachments, 'params.yaml': parameter_file(parameters, 'fuzzed')}
    made = []
    with playground() as folder:
        for name, options in (('zstd', {}), ('plain', {'use_chunking': False})):
            bag = Bag(folder / f'{name}.mcap', chunk_size=4000, **options)
            for file, text in attached.items():
                bag.attach(file, text)
            for k in range(12):
                ns, row = k * 10_000_000, np.sin(np.arange(1.0, 7.0) * (k + 1))
                state = np.array([0, 0, 0, 1, 0, 0, 0, *row])
                bag.add('/odom', ODOMETRY, ns, serialized(odometry(ns, state)))
                for topic, kind in TOPICS.items():
                    message = stamped(kind, ns, row)
                    bag.add(topic, message.__msgtype__, ns, serialized(message))
            made.append(bag.close().read_bytes())
    return made


def originals(folder: str) -> list[Any]:
    """Shipped files as nested mappings; scenarios short, with everything that may stand in one."""
    found = [yaml.safe_load(path.read_text()) for path in shipped(folder)]
    if folder != 'scenarios':
        return found
    short = [{**data, 'duration': STEPS * data['step'] / 2} for data in found[:3]]
    return [*found, *short, {**short[0], **EVERYTHING}]


EVERYTHING = {
    'disturbance': [
        {'kind': 'herman2018'},
        {
            'kind': 'harmonic',
            'heave': {'offset': -3.0, 'terms': [{'amplitude': 1.0, 'omega': 1.0}]},
        },
        {'kind': 'model_error', 'mass': 0.05, 'added_mass': -0.1, 'damping': 0.2},
        {'kind': 'current', 'velocity': [0.1, 0.0, 0.0]},
    ],
    'vehicle': 'rexrov',
    'actuators': {'limit': [900.0] * 6, 'rate': [5000.0] * 6, 'lag': 0.05, 'delay': 0.02},
    'sensors': {'velocity_noise': 0.01, 'attitude_noise': 0.001, 'drop_out': 0.1},
    'faults': [
        {'kind': 'sensor_drop_out', 'probability': 0.5, 'from': 0.02, 'to': 0.1},
        {'kind': 'sensor_delay', 'delay': 0.03, 'from': 0.1, 'to': 0.2},
        {'kind': 'sensor_bias', 'velocity': [0.01] * 6, 'attitude': [0.0, 0.01, 0.0], 'from': 0.1},
        {'kind': 'actuator', 'axis': 'surge', 'efficiency': 0.5, 'from': 0.0},
        {'kind': 'wrench_loss', 'probability': 0.2, 'from': 0.2, 'timeout': 0.1},
    ],
}
