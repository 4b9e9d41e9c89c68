"""Logs of ArduSub, whole, cut, damaged and hostile, read as other bags are."""

import io
import json
import struct
import sys
from contextlib import redirect_stdout
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from helpers import mavlink_files as logs
from helpers import sea_trials
from numpy.testing import assert_allclose, assert_array_equal

from auv_analysis.bag.any_bag import messages, survey
from auv_analysis.bag.foreign_run import load_foreign
from auv_analysis.bag.foreign_topics import read_mapping
from auv_analysis.bag.mavlink_logs import preset, too_slow
from auv_analysis.bag.metadata import TopicExtent
from auv_analysis.bag.reading import BagContents
from auv_analysis.cli.main import main
from auv_analysis.runs.run import Run
from auv_dynamics import load_vehicle
from auv_dynamics.files.errors import InputError
from auv_dynamics.vehicle.thruster_curves import load_curve

VEHICLE = 'bluerov2_heavy'
CURVE = 't200_16v'


@pytest.fixture(scope='module')
def run(tmp_path_factory) -> Run:
    amplitudes, band, _ = sea_trials.SWINGS[VEHICLE]
    slower = sea_trials.multisine(tuple(0.7 * amplitude for amplitude in amplitudes), band)
    return sea_trials.trial(tmp_path_factory.mktemp('x'), VEHICLE, duration=20.0, setpoint=slower)[
        1
    ]


@pytest.fixture(scope='module')
def pulses(run) -> np.ndarray:
    found = logs.pulses(run, load_vehicle(VEHICLE), CURVE)
    assert 1100 < found.min() < found.max() < 1900  # nothing saturates
    return found


@pytest.fixture(scope='module', params=['dive.tlog', 'dive.BIN'])
def log(request, run, pulses, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp('logs') / request.param
    if path.suffix == '.tlog':
        return logs.write_tlog(path, logs.telemetry(run, pulses))
    path.write_bytes(logs.onboard(run, pulses))
    return path


def output(*arguments: object) -> Any:
    """What a command prints with --json."""
    printed = io.StringIO()
    with redirect_stdout(printed):
        main([*(str(argument) for argument in arguments), '--json'])
    return json.loads(printed.getvalue())


@pytest.fixture(scope='module')
def mapping(log) -> Path:
    """The mapping that `auv info` proposes, with the vehicle put in."""
    proposed = output('info', log)['mapping']
    path = log.with_suffix('.yaml')
    path.write_text(proposed.replace('# vehicle: my_auv.yaml', f'vehicle: {VEHICLE}'))
    return path


def test_a_log_by_the_proposed_mapping_is_the_run(log, mapping, run) -> None:
    vehicle, curve = load_vehicle(VEHICLE), load_curve(CURVE)
    found = load_foreign(log, read_mapping(mapping, {})).run
    assert found.step == run.step
    assert_allclose(found.t, run.t, atol=1e-9)
    assert_allclose(found.eta, run.eta, atol=2e-6)  # single precision
    assert_allclose(found.nu, run.nu, atol=2e-6)
    half = 0.5 * np.max(np.diff(curve.thrusts) / np.diff(curve.commands))  # N of half a us
    assert vehicle.thrusters is not None
    bound = half * np.abs(vehicle.thrusters.matrix).sum(axis=1)
    assert np.all(np.abs(found.tau - run.tau) <= bound + 1e-9)
    assert np.abs(found.tau - run.tau).max() > 0.0
    assert found.unexplained is not None


def test_energies_of_a_log_are_those_of_the_run(log, mapping, run) -> None:
    from auv_analysis import summarize

    out = log.with_suffix('')
    (found,) = output('analyze', log, '--map', mapping, '--out', out, '--no-report').values()
    truth = summarize(run)
    for key in ('mean_by_component', 'shares_percent'):
        assert_allclose(found['kinetic_energy'][key], truth['kinetic_energy'][key], rtol=1e-5)
    assert_allclose(found['coupling']['delta_xi_max'], truth['coupling']['delta_xi_max'], atol=1e-6)


@pytest.mark.parametrize(
    'log', ['dive.tlog', pytest.param('dive.BIN', marks=pytest.mark.long)], indirect=True
)
def test_a_vehicle_is_identified_from_a_log(log, mapping, tmp_path) -> None:
    out = tmp_path / 'identified'
    few = ('--free', 'M.diagonal', '--free', 'lag', '--free', 'delay')  # all of it takes seconds
    main(['identify', str(log), '--map', str(mapping), '--vehicle', VEHICLE, '--out', str(out),
          '--no-report', *few])  # fmt: skip
    found, truth = load_vehicle(out / 'vehicle.yaml'), load_vehicle(VEHICLE)
    assert_allclose(np.diag(found.M), np.diag(truth.M), rtol=0.02)


def test_thrusters_are_those_that_the_parameters_name(run, tmp_path) -> None:
    """Motors on other outputs, two of them reversed."""
    mirrored = np.isin(np.arange(8), [0, 5])
    order = np.array([3, 2, 1, 0, 4, 5, 7, 6])  # output of each motor
    run = run.part(slice(300))
    turned = logs.pulses(run, load_vehicle(VEHICLE), CURVE, mirrored)
    outputs = np.zeros_like(turned)
    outputs[:, order] = turned
    told = [logs.parameter(f'SERVO{order[m] + 1}_FUNCTION', 33 + m) for m in range(8)]
    told += [logs.parameter(f'MOT_{m + 1}_DIRECTION', -1 if mirrored[m] else 1) for m in range(8)]
    told.append(logs.parameter('FRAME_CONFIG', 2))
    sent = [(logs.EPOCH, logs.VEHICLE, one) for one in told]
    sent.append((logs.EPOCH, (7, 1), logs.parameter('FRAME_CONFIG', 4)))  # of another vehicle
    heard = [one for one in logs.telemetry(run, outputs) if 'DIRECTION' not in str(one[2])]
    log = logs.write_tlog(tmp_path / 'x.tlog', [*sent, *heard])
    proposed = yaml.safe_load(output('info', log)['mapping'])
    assert proposed['thrusters']['fields'][:2] == ['servo4_raw', 'servo3_raw']
    assert proposed['thrusters']['reversed'] == [1, 6]
    found = load_foreign(log, read_mapping(None, proposed | {'vehicle': VEHICLE})).run
    assert_allclose(found.tau, run.tau, atol=1.0)


@pytest.mark.parametrize(
    ('frame', 'motors'), [('0', 6), ('1', 6), ('2', 8), ('3', 8), ('4', 3), ('5', 4), ('6', 5)]
)
def test_a_frame_of_ardusub_has_so_many_motors(frame: str, motors: int) -> None:
    topics = {topic: f'mavlink/{topic}' for topic in ('ATTITUDE', 'SERVO_OUTPUT_RAW')}
    contents = BagContents(types=topics, parameters={'FRAME_CONFIG': frame})
    proposed = yaml.safe_load(preset(contents))
    assert proposed['thrusters']['fields'] == [f'servo{i + 1}_raw' for i in range(motors)]


@pytest.mark.parametrize(
    ('topics', 'twist', 'rates'),
    [
        (['RATE', 'IMU[0]'], [('RATE', 'R P Y')], None),
        (['IMU[0]', 'IMU'], [('IMU[0]', 'GyrX GyrY GyrZ')], None),
        (['NKF1', 'XKF1[0]'], [('XKF1[0]', '')], 'from attitude'),
        (['NKF1[0]', 'NKF1'], [('NKF1[0]', '')], 'from attitude'),
        (['NKF1'], [('NKF1', '')], 'from attitude'),
        ([], [], 'from attitude'),
    ],
)
def test_angular_velocity_comes_from_the_best_that_is_on_board(topics, twist, rates) -> None:
    contents = BagContents(types={topic: f'dataflash/{topic}' for topic in ('ATT', *topics)})
    proposed = yaml.safe_load(preset(contents))
    found = [
        (one['topic'], ' '.join(one['fields'][i] for i in 'pqr' if i in one['fields']))
        for one in proposed['twist']
    ]
    assert (found, proposed.get('rates')) == (twist, rates)


def test_other_systems_are_left_out(run, pulses, tmp_path) -> None:
    heard = logs.telemetry(run.part(slice(0, 200)), pulses[:200])
    ghost = [
        (time - 1, (0, 1), message) for time, sender, message in heard if sender == logs.VEHICLE
    ][::2]  # fmt: skip
    heard.append((heard[-1][0], logs.VEHICLE, logs.heartbeat()))
    both = sorted([*heard, *ghost], key=lambda one: one[0])
    log = logs.write_tlog(tmp_path / 'two.tlog', both)
    contents = survey(log)
    assert contents.counts['ATTITUDE'] == 200
    others = len(ghost) + sum(sender == logs.GROUND for _, sender, _ in both)
    assert contents.notes == [
        'two.tlog: read system 1, component 1, the most heard of 2 autopilots; left '
        f'{others} messages of 2 other senders'
    ]
    notes: list[str] = []
    assert len(list(messages(log, ['ATTITUDE', 'HEARTBEAT'], notes))) == 202
    silent = [one for one in both if 'HEARTBEAT' not in str(one[2])]
    with pytest.raises(InputError, match=r'heartbeats of the autopilot.* from 0\.1, 1\.1'):
        survey(logs.write_tlog(tmp_path / 'silent.tlog', silent))
    usual = survey(logs.write_tlog(tmp_path / 'usual.tlog', heard)).notes
    others -= len(ghost)
    assert usual == [f'usual.tlog: read system 1, component 1; left {others} messages of 1 other '
                     'senders']  # fmt: skip
    alone = [one for one in silent if one[1] == logs.VEHICLE]
    assert survey(logs.write_tlog(tmp_path / 'alone.tlog', alone)).counts['ATTITUDE'] == 200


def test_messages_with_a_wrong_checksum_are_left_out_and_counted(run, pulses, tmp_path) -> None:
    log = logs.write_tlog(tmp_path / 'x.tlog', logs.telemetry(run.part(slice(20)), pulses[:20]))
    data = bytearray(log.read_bytes())
    data[-1] ^= 1  # of the last servo outputs
    log.write_bytes(data)
    notes: list[str] = []
    assert len(list(messages(log, ['SERVO_OUTPUT_RAW'], notes))) == 19
    assert 'x.tlog: 1 messages left out, whose checksum is wrong' in notes


@pytest.mark.parametrize('version', [1, 2])
def test_each_port_and_named_value_is_a_topic(version: int, run, pulses, tmp_path) -> None:
    sent = logs.telemetry(run.part(slice(20)), pulses[:20])
    last = sent[-1]
    more = [
        logs.mavlink.MAVLink_servo_output_raw_message(last[2].time_usec, 1, *[1500] * 16),
        logs.mavlink.MAVLink_named_value_float_message(5, b'Depth', 1.0),
        logs.mavlink.MAVLink_named_value_float_message(5, b'CamTilt', 2.0),
    ]
    if version == 2:  # whose types have numbers above 255
        fours = [[i] * 4 for i in range(6)]
        more.append(logs.mavlink.MAVLink_esc_telemetry_1_to_4_message(*fours))
    sent += [(last[0], logs.VEHICLE, one) for one in more]
    log = logs.write_tlog(tmp_path / 'x.tlog', sent, version)
    counts = survey(log).counts
    assert (counts['SERVO_OUTPUT_RAW'], counts['SERVO_OUTPUT_RAW[1]']) == (20, 1)
    servos = [m.servo1_raw for _, _, m in messages(log, ['SERVO_OUTPUT_RAW'], [])]
    assert servos == pulses[:20, 0].tolist()
    (tilt,) = messages(log, ['NAMED_VALUE_FLOAT[CamTilt]'], [])
    assert tilt.message.value == 2.0
    assert counts.get('ESC_TELEMETRY_1_TO_4', 0) == version - 1


def test_servo_outputs_keep_their_clock_when_it_wraps(run, pulses, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(logs, 'BOOT', 2**32 // 1000 - 500)  # half a second before
    heard = logs.telemetry(run, pulses)
    log = logs.write_tlog(tmp_path / 'x.tlog', heard[:400])
    stamps = [m.time_usec for _, _, m in messages(log, ['SERVO_OUTPUT_RAW'], [])]
    assert stamps[0] < 2**32 < stamps[-1]
    assert_array_equal(np.diff(stamps), 20_000)
    later = logs.write_tlog(tmp_path / 'y.tlog', [*heard[:2], *heard[210:400]])
    stamps = [m.time_usec for _, _, m in messages(later, ['SERVO_OUTPUT_RAW'], [])]
    assert stamps[0] > 2**32


def test_both_versions_of_mavlink_may_stand_in_a_log(run, pulses, tmp_path) -> None:
    heard = logs.telemetry(run.part(slice(0, 100)), pulses[:100])
    second = logs.write_tlog(tmp_path / 'x.tlog', heard)
    first = logs.write_tlog(tmp_path / 'y.tlog', heard, version=1)
    signed = logs.write_tlog(tmp_path / 's.tlog', heard, signed=True)
    assert signed.stat().st_size == second.stat().st_size + 13 * len(heard)
    assert first.read_bytes()[8] == 0xFE
    both = tmp_path / 'z.tlog'
    both.write_bytes(first.read_bytes() + second.read_bytes())
    counts = [survey(path).counts for path in (first, second, signed, both)]
    assert counts[0] == counts[1] == counts[2] == {t: n // 2 for t, n in counts[3].items()}
    read = [
        [(stamp, m.to_dict()) for _, stamp, m in messages(path, ['ATTITUDE'], [])]
        for path in (first, second, signed)
    ]
    assert read[0] == read[1] == read[2]


def test_time_of_an_onboard_log_is_that_of_gps(tmp_path) -> None:
    written = [
        logs.definitions(), logs.record(logs.GPS, 5_000_000, 0, 0, 0),  # no fix
        logs.record(logs.GPS, 6_000_000, 432_000_250, 2288, 473_977_000),
        logs.record(logs.ATT, 7_500_000, 0, 0, 0, 0, 0, 0, 0),
        logs.record(logs.GPS, 8_000_000, 432_003_250, 2288, 0),  # its clock has jumped
    ]  # fmt: skip
    log = tmp_path / 'x.bin'
    log.write_bytes(b''.join(written))
    ((topic, stamp, _),) = messages(log, ['ATT'], [])
    # the fifth day of week 2288 is 2023-11-17, and GPS is 18 s ahead of UTC
    expected = np.datetime64('2023-11-16T23:59:42.250') + np.timedelta64(1500, 'ms')
    assert (topic, np.datetime64(stamp, 'ns')) == ('ATT', expected)
    contents = survey(log)  # definitions have no time
    assert (contents.first, contents.last) == (stamp - 2_500_000_000, stamp + 500_000_000)
    assert contents.counts['GPS'] == 3
    fixes = [fix.message.Lat for fix in messages(log, ['GPS'], [])]
    assert fixes == pytest.approx([0.0, 47.3977, 0.0])


def test_sensors_are_told_apart_by_the_field_that_says_which(tmp_path) -> None:
    """Whatever stands before it, if it is a byte, and where definitions are written again."""
    types = [
        (0x90, 'BARO', 'QBhfB', 'TimeUS,A,B,Press,I'), (0x91, 'WIDE', 'QHB', 'TimeUS,I,A'),
        (0x92, 'FLAT', 'QB', 'TimeUS,A'),
    ]  # fmt: skip
    units = {'BARO': 's---#', 'WIDE': 's#-', 'FLAT': 's-'}
    told = logs.definitions((logs.FMT, logs.FMTU, *types), units)
    written = [
        told, logs.record(types[0], 1, 7, 8, 0.5, 2), logs.definitions(types, {}),
        logs.record(types[0], 2, 7, 8, 0.5, 3), logs.record(types[1], 3, 4, 5),
        logs.record(types[2], 4, 6),
    ]  # fmt: skip
    log = tmp_path / 'x.bin'
    log.write_bytes(b''.join(written))
    counts = survey(log).counts
    assert {topic: counts[topic] for topic in counts if topic[:3] != 'FMT'} == {
        'BARO[2]': 1, 'BARO[3]': 1, 'WIDE': 1, 'FLAT': 1
    }  # fmt: skip
    (found,) = messages(log, ['BARO[3]'], [])
    assert (found.log_time, found.message.Press) == (2000, 0.5)


def test_slow_topics_are_named_with_what_raises_them(run, pulses, tmp_path) -> None:
    log = logs.write_tlog(tmp_path / 'x.tlog', logs.telemetry(run, pulses, 10, 5))  # 5 and 1 Hz
    notes = survey(log).notes
    read: list[str] = []
    list(messages(log, ['ATTITUDE', 'SERVO_OUTPUT_RAW'], read))
    for said in (notes, read):
        assert any('ATTITUDE: 5 Hz' in note and 'SR0_EXTRA1' in note for note in said)
        servos = next(note for note in said if note.startswith('SERVO_OUTPUT_RAW: 1 Hz'))
        assert 'SR0_RC_CHAN' in servos
        assert 'MAV_CMD_SET_MESSAGE_INTERVAL' in servos
    alone: list[str] = []
    list(messages(log, ['ATTITUDE'], alone))
    assert [note[:9] for note in alone] == ['ATTITUDE:'], 'of what is read alone'
    for last, count, said in ((10**9, 10, 0), (10**9 + 1, 10, 1), (10**9, 1, 0), (10**9, 2, 1)):
        assert len(too_slow('ATT', TopicExtent(0, last, count))) == said
    slow = tmp_path / 'x.BIN'
    slow.write_bytes(logs.onboard(run, pulses, 25))
    assert any('ATT: 2 Hz' in n and 'LOG_BITMASK' in n for n in survey(slow).notes)


def everything(path: Path) -> tuple[int, list[str]]:
    """How many messages are read of a log, and what is noted."""
    notes: list[str] = []
    return sum(1 for _ in messages(path, survey(path).types, notes)), notes


@pytest.fixture(scope='module')
def every(log) -> int:
    count, notes = everything(log)
    assert not any('damaged' in note for note in notes)
    return count


def test_a_cut_log_is_read_to_its_end(log, every, tmp_path) -> None:
    whole, cut = log.read_bytes(), tmp_path / log.name
    for size in (len(whole) // 3, len(whole) // 2 + 7, len(whole) - 1):
        cut.write_bytes(whole[:size])
        count, _notes = everything(cut)
        assert abs(count - every * size / len(whole)) < 0.02 * every
        assert count < every


@pytest.mark.parametrize('seed', range(2))
def test_a_damaged_log_loses_what_is_damaged(log, every, seed, tmp_path) -> None:
    rng, data = np.random.default_rng(seed), bytearray(log.read_bytes())
    damaged = tmp_path / log.name
    begin = len(data) // 10
    for place in rng.integers(begin, len(data) - 200, 20).tolist():
        data[place : place + 100] = rng.bytes(100)
    hole = len(data) // 2
    data[hole:hole] = bytes(5000)
    damaged.write_bytes(data)
    count, notes = everything(damaged)
    assert 0.97 * every < count < every
    assert any('bytes are no' in note for note in notes)


@pytest.mark.parametrize('ending', ['.tlog', '.BIN'])
def test_bytes_that_are_no_messages_are_counted_once(ending, run, pulses, tmp_path) -> None:
    """Between messages, and a record whose time is none."""
    path, part = tmp_path / f'x{ending}', run.part(slice(20))
    if ending == '.tlog':
        whole = logs.write_tlog(path, logs.telemetry(part, pulses[:20])).read_bytes()
        second = logs.write_tlog(path, logs.telemetry(part, pulses[:20])[:1]).stat().st_size
        late = struct.pack('>Q', 2**53) + whole[8:second]
    else:
        whole, late = logs.onboard(part, pulses[:20]), logs.record(logs.ATT, 2**53, *[0] * 7)
        second = len(logs.definitions())
    path.write_bytes(whole[:second] + b'seven b' + late + whole[second:])
    notes: list[str] = []
    assert len(list(messages(path, ['ATTITUDE', 'ATT'], notes))) == 20
    for said in (notes, survey(path).notes):
        damage = [note for note in said if 'damaged' in note]
        assert [note.partition(' bytes')[0] for note in damage] == [
            f'x{ending}: damaged: {7 + len(late)}'
        ]


@cache
def hostile() -> dict[str, bytes]:
    """Files that ask for too much, or for nothing at all."""
    rng = np.random.default_rng(0)
    head = logs.definitions()
    empty = logs.record(logs.FMT, 7, 0, 'ZERO', '', '')
    unknown = logs.record(logs.FMT, 7, 12, 'ODD', 'Q?', 'TimeUS,x')
    itself = logs.record(logs.FMT, 0x80, 4, 'FMT', 'B', 'x')
    late = logs.record(logs.ATT, 2**63, 0, 0, 0, 0, 0, 0, 0)
    fewer = logs.record(logs.FMT, 7, 12, 'ODD', 'QB', 'TimeUS')
    names = b''.join(
        logs.record(logs.FMT, 7, 4, f'A{i:03x}', 'B', 'x') + b'\xa3\x95\x07\x00'
        for i in range(11_000)
    )
    return {
        'empty': b'', 'byte': b'\xfe', 'zeros': bytes(20_000), 'v1.tlog': b'\xfe' * 60_000,
        'v2.tlog': b'\xfd' * 60_000, 'noise': rng.bytes(40_000),
        'loop.BIN': head + empty + b'\xa3\x95\x07' * 1000, 'format.BIN': head + unknown * 50,
        'fewer.BIN': head + fewer + b'\xa3\x95\x07' + bytes(9),
        'itself.BIN': head + itself + head, 'late.BIN': head + late * 20, 'names.BIN': names,
        'short.tlog': bytes(8) + b'\xfe\x00\x00\x01\x01\x00\xff\xff',
        'heads.BIN': b'\xa3\x95' * 10_000,
        'instance.BIN': head + logs.record(logs.FMTU, 0, 0x85, '#' * 16, '') * 9 + itself,
        'beyond.BIN': head + logs.record(logs.FMTU, 0, 0x84, '-' * 15 + '#', ''),
    }  # fmt: skip


HOSTILE = [
    (name, ending) for name in hostile() for ending in ('.tlog', '.BIN')
    if '.' not in name or name.endswith(ending)
]  # fmt: skip


@pytest.mark.parametrize(('name', 'ending'), HOSTILE)
def test_hostile_logs_end_in_a_line_or_are_read(name, ending, tmp_path) -> None:
    path = tmp_path / f'x{ending}'
    path.write_bytes(hostile()[name])
    line = ''
    try:
        everything(path)
    except InputError as refused:
        line = str(refused)
    assert line == '' or line.startswith(f'{path}: ')
    assert '\n' not in line


@pytest.mark.parametrize('ending', ['.tlog', '.BIN'])
def test_what_is_no_log_is_refused_in_one_line(ending, tmp_path, capsys) -> None:
    path = tmp_path / f'x{ending}'
    for data in (None, b'', bytes(1000)):
        if data is not None:
            path.write_bytes(data)
        for arguments in (('info', path), ('analyze', path)):
            with pytest.raises(SystemExit) as end:
                main([str(argument) for argument in arguments])
            captured = capsys.readouterr()
            assert (end.value.code, captured.out) == (2, '')
            (line,) = captured.err.splitlines()
            assert str(path) in line


def test_without_a_mapping_info_is_pointed_to(log, capsys) -> None:
    with pytest.raises(SystemExit) as end:
        main(['analyze', str(log)])
    assert end.value.code == 2
    assert f'expected --map FILE: auv info {log} proposes one' in capsys.readouterr().err


def test_without_pymavlink_one_line_says_so(log, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, 'pymavlink', None)
    with pytest.raises(InputError, match=r'pymavlink: .*pip install -r requirements-mavlink.txt'):
        survey(log)
