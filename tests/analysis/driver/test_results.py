"""What a check leaves and shows: document, samples, report, terminal; and what is documented."""

import io
import json
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.made_odometry import graph, healthy
from helpers.simulated_driver import SimulatedDriver
from pyarrow import parquet
from rich.console import Console

from auv_analysis.cli import check_driver
from auv_analysis.cli.main import main, parser
from auv_analysis.driver import report
from auv_analysis.driver.checks import (
    CHECKS,
    GROUPS,
    document_of,
    failure_of,
    findings_table,
    judge,
    refusal,
)
from auv_analysis.driver.evidence import (
    NOT_CHECKED,
    PASS,
    VERDICTS,
    CheckResult,
    DriverRecord,
    Settings,
)
from auv_analysis.driver.excitation import carry_out
from auv_analysis.driver.plan import Plan, plan_of
from auv_analysis.driver.report import write_results
from auv_analysis.graph import domain
from auv_dynamics.ros.interface import Frames

ROOT = Path(__file__).parents[3]


def listened(**fields: object) -> DriverRecord:
    why = 'nothing is sent without --actuate'
    return DriverRecord(graph(), healthy(**fields), Settings(), passive=why)


def commanded() -> DriverRecord:
    driver = SimulatedDriver(noise=1e-3)
    plan = plan_of(driver.vehicle, ['surge'], 0.1, None, None)
    excitation = carry_out(driver, plan, 0.5, lambda: False)
    return DriverRecord(graph(), driver.log(), Settings(actuates=True), excitation)


def shown(evidence: DriverRecord) -> str:
    out = io.StringIO()
    Console(file=out, width=80).print(findings_table(judge(evidence)))
    return out.getvalue()


class Client(SimulatedDriver):
    """Stands for that of ROS: it notes how it was made."""

    made: list['Client']

    def __init__(self, *given: object, commands: bool) -> None:
        super().__init__()
        self.given, self.commands = given, commands
        self.made.append(self)

    def log(self, began: int):
        return super().log()

    def graph(self, place: str, **_: object):
        return replace(graph(), place=place)

    def publishes(self) -> bool:
        return True

    def close(self) -> None:
        self.closed = True


def test_a_vehicle_with_a_fault_is_not_moved_and_options_are_heard(monkeypatch, capsys) -> None:
    Client.made = []
    node = SimpleNamespace(RosDriverClient=Client)
    monkeypatch.setitem(sys.modules, 'auv_analysis.nodes.driver_check_node', node)
    monkeypatch.setattr(domain, 'join_domain', lambda asked: asked)
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')  # as it would
    options = '--actuate', '--vehicle', 'bluerov2_heavy', '--seconds', '0.1', '--expect-rate', '7'
    names = '--odom', 'nav/odom', '--wrench', '/thrust', '--namespace', '/auv1'
    frames = '--odom-frame', 'map', '--base-frame', 'body', '--use-sim-time', '--domain-id', '7'
    with pytest.raises(SystemExit) as end:
        main(['check-driver', *options, *names, *frames, '--json'])
    assert end.value.code == 1
    (client,) = Client.made
    told = {'odom': 'nav/odom', 'wrench': '/thrust'}
    assert client.given == (7, '/auv1', told, Frames('map', 'body'))
    assert (client.commands, client.sent, client.closed) == (True, [], True)
    document = json.loads(capsys.readouterr().out)
    assert document['place'] == 'ROS_DOMAIN_ID=7, namespace /auv1'
    settings = document['settings']
    assert (settings['rate'], settings['sim_time'], settings['actuates']) == (7.0, True, True)
    assert settings['frames'] == {'odom': 'map', 'base': 'body'}
    said = {one['id']: (one['verdict'], one['found']) for one in document['checks']}
    assert said['frames'][0] == 'fail'
    assert said['response_surge'][0] == NOT_CHECKED
    assert said['response_surge'][1].startswith('nothing was sent, since frames ')


class Clock:
    """Stands for `time`; a client listens by it, from 2 s on to messages, if at all."""

    def __init__(self, *, sends: bool, publishes: bool) -> None:
        self.now, self.listened = 0.0, list[float]()
        self._sends, self._publishes = sends, publishes

    def monotonic(self) -> float:
        return self.now

    def time_ns(self) -> int:
        return round(self.now * 1e9)

    @property
    def buffer(self) -> range:
        return range(self._sends and self.now >= 2.0)

    def listen(self, seconds: float) -> None:
        self.listened.append(seconds)
        self.now += seconds

    def publishes(self) -> bool:
        return self._publishes


@pytest.mark.parametrize(
    ('sends', 'publishes', 'began', 'ended'),
    [(True, True, 2.0, 2.25), (False, True, 5.0, 5.25), (False, False, 5.0, 5.0)],
)
def test_it_listens_from_the_first_odometry_on(sends, publishes, began, ended, monkeypatch) -> None:
    clock = Clock(sends=sends, publishes=publishes)
    monkeypatch.setattr(check_driver, 'time', clock)
    found = check_driver._listen(clock, 0.25)
    assert found / 1e9 == pytest.approx(began, abs=1.01 * check_driver.LOOK)
    assert clock.now == pytest.approx(found / 1e9 + ended - began)
    assert max(clock.listened) <= check_driver.LOOK


def test_a_document_is_json_and_counts_add_up() -> None:
    x = healthy().x.copy()
    x[3, 8] = np.inf
    for evidence in (listened(), listened(x=x)):
        document = document_of(evidence, judge(evidence))
        document = json.loads(json.dumps(document, allow_nan=False))
        assert sum(document['counts'].values()) == len(document['checks']) == len(CHECKS)
        assert {one['verdict'] for one in document['checks']} <= set(VERDICTS)
        assert document['settings']['frames'] == {'odom': 'odom_ned', 'base': 'base_link_fsd'}


def test_only_failures_fail() -> None:
    findings = judge(listened())
    assert failure_of(findings) == ''
    assert {one.verdict for one in findings} == {PASS, NOT_CHECKED}
    broken = judge(listened(frames={('odom', 'base_link'): 500}))
    assert failure_of(broken) == f'1 of {len(CHECKS)} checks failed: frames'
    gone = judge(replace(listened(), graph=graph(odom_publishers=())))
    assert failure_of(gone).startswith('nobody publishes /odom in ROS_DOMAIN_ID=7')
    both = graph().odom_publishers * 2
    several = judge(replace(listened(), graph=graph(odom_publishers=both)))
    assert failure_of(several) == f'1 of {len(CHECKS)} checks failed: odom_publisher'


def test_the_terminal_shows_each_failure_with_what_was_expected_and_advice() -> None:
    text = ' '.join(shown(listened(frames={('odom', 'base_link'): 500})).split())
    for words in (
        'Who is there odom_publisher pass',
        "Frames and numbers frames fail 'odom' and 'base_link'",
        'expected: header.frame_id odom_ned',
        'frame_converter_node',
        'nothing is sent without --actuate',
        '1 fail',
    ):
        assert words in text


@pytest.mark.usefixtures('unrendered')
def test_the_folder_holds_report_document_and_all_that_was_heard_and_sent(
    tmp_path: Path, approved
) -> None:
    evidence = commanded()
    findings = judge(evidence)
    document = document_of(evidence, findings)
    page = write_results(tmp_path, evidence, findings, document).read_text()
    approved.folder(tmp_path)
    assert json.loads((tmp_path / 'check.json').read_text()) == document
    for title in GROUPS.values():
        assert title in page
    for id in CHECKS:
        assert f'>{id}' in page
    samples = parquet.read_table(tmp_path / 'samples.parquet')
    for name in ('arrived_ns', 'stamp_ns'):
        assert samples[name].to_pylist() == getattr(evidence.log, name).tolist()
    assert samples.column_names[2:] == [
        'x',
        'y',
        'z',
        'qw',
        'qx',
        'qy',
        'qz',
        'u',
        'v',
        'w',
        'p',
        'q',
        'r',
    ]
    np.testing.assert_array_equal(np.array(samples.columns[2:]).T, evidence.log.x)
    sent = parquet.read_table(tmp_path / 'wrenches.parquet')
    assert set(sent['trial'].to_pylist()) == {'surge'}
    assert sent.column_names == ['trial', 'sent_ns', *'XYZKMN']
    steps = [tau for one in evidence.excitation.sent for _, tau in one.steps]
    np.testing.assert_array_equal(np.array(sent.columns[2:]).T, steps)
    assert np.abs(sent['X']).max() == pytest.approx(document['trials'][0]['size'])
    figures = {path.stem for path in (tmp_path / 'figures').iterdir()}
    assert figures == {'timing', 'linear', 'angular', 'answers'}


@pytest.mark.usefixtures('unrendered')
def test_a_driver_that_is_not_there_leaves_a_report_as_well(tmp_path: Path, approved) -> None:
    heard = healthy()
    nothing = replace(heard, **{name: getattr(heard, name)[:0] for name in
                                ('arrived_ns', 'stamp_ns', 'published_ns', 'x')},
                      frames={})  # fmt: skip
    evidence = DriverRecord(graph(odom_publishers=()), nothing, Settings(), passive='not asked for')
    findings = judge(evidence)
    write_results(tmp_path, evidence, findings, document_of(evidence, findings))
    approved.folder(tmp_path)
    assert parquet.read_table(tmp_path / 'samples.parquet').num_rows == 0


def test_every_check_is_documented() -> None:
    text = (ROOT / 'docs/check-driver.md').read_text()
    for id in CHECKS:
        assert f'`{id}`' in text or f'`{id.partition("_")[0]}_<dof>`' in text, id


@pytest.mark.parametrize(
    ('options', 'words'),
    [
        (['--actuate'], ('--vehicle', 'a vehicle file with --actuate')),
        (['--actuate', '--vehicle', 'nowhere'], ('nowhere',)),
        (['--actuate', '--vehicle', 'bluerov2', '--axis', 'pitch'], ('--axis', 'bluerov2')),
        (['--seconds', '0'], ('--seconds', 'a number above 0')),
        (['--speed', '2'], ('--speed', 'at most 0.5')),
        (['--force', 'much'], ('--force',)),
        (['--expect-rate', 'nan'], ('--expect-rate',)),
        (['--namespace', '/a b'], ('--namespace',)),
        (['--odom', 'no topic'], ('--odom', 'a ROS topic')),
        (['--domain-id', '200'], ('--domain-id',)),
    ],
)
def test_wrong_input_is_one_line_and_exit_code_2(options, words, capsys) -> None:
    with pytest.raises(SystemExit) as ended:
        main(['check-driver', *options])
    assert ended.value.code == 2
    out, err = capsys.readouterr()
    assert out == ''
    assert len(err.splitlines()) == 1
    for word in (*words, 'expected', 'found'):
        assert word in err


def planned(line: str) -> Plan:
    return check_driver._plan(parser().parse_args(f'check-driver --actuate {line}'.split()))


def test_a_plan_is_bounded_by_the_command_line() -> None:
    plan = planned('--vehicle rexrov --axis surge --axis yaw --force 5 --torque 2')
    sizes = [(one.dof, one.size, one.silent) for one in plan.trials]
    assert sizes == [('surge', 5.0, False), ('yaw', 2.0, False), ('surge', 5.0, True)]
    assert planned('--vehicle bluerov2_heavy --speed 0.05').speed == pytest.approx(0.05, rel=1e-3)
    assert 0.11 < planned('--vehicle bluerov2_heavy').speed <= 0.5  # above their dead band


def test_a_folder_that_is_there_is_refused_before_anything_is_heard(tmp_path, capsys) -> None:
    (tmp_path / 'mine.txt').write_text('kept')
    with pytest.raises(SystemExit) as ended:
        main(['check-driver', '--out', str(tmp_path)])
    assert ended.value.code == 2
    assert '--overwrite' in capsys.readouterr().err
    assert (tmp_path / 'mine.txt').read_text() == 'kept'


def test_results_of_an_earlier_check_are_replaced_when_asked(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.setattr(report, 'write_results', lambda out, *_: (out / 'check.json').touch())
    for quiet in (True, False):
        options = SimpleNamespace(json=quiet, out=tmp_path / 'out', overwrite=True, vehicle=None)
        check_driver._conclude(options, listened())
        assert ('upright' in capsys.readouterr().out) is not quiet


def test_nothing_is_sent_unless_those_pass_on_whom_safety_rests() -> None:
    needed = {
        'odom_publisher', 'wrench_subscriber', 'wrench_publishers', 'qos_wrench', 'frames',
        'finite', 'quaternion_norm', 'rate', 'gaps', 'stamps',
    }  # fmt: skip
    for name in CHECKS:
        for verdict in VERDICTS:
            said = refusal([CheckResult('', '', verdict, id=name)])
            bad = name in needed and verdict != PASS
            assert said == (f'nothing was sent, since {name} did not pass' if bad else '')
