"""`auv doctor`: each fault of a set-up is provoked and named, with what to do."""

import ctypes
import inspect
import json
import mmap
import os
import platform
import resource
import shutil
import signal
import subprocess
import sys
from collections import namedtuple
from contextlib import nullcontext
from importlib.util import find_spec
from pathlib import Path

import pytest

from auv_analysis.cli import doctor, main
from auv_analysis.cli.doctor import findings_of
from auv_analysis.doctor import checks, discovery
from auv_analysis.doctor.checks import Finding
from auv_analysis.graph import supervisor
from auv_analysis.graph.supervisor import NodeDiedError
from auv_dynamics.ros.security import PROFILES, loopback

RANGE = checks.RANGE
Usage = namedtuple('Usage', 'total used free')


@pytest.fixture(autouse=True)
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ('ROS_DISTRO', 'RMW_IMPLEMENTATION', RANGE, 'ROS_LOCALHOST_ONLY', 'ROS_DOMAIN_ID',
                 'AMENT_PREFIX_PATH', 'PYTHONPATH', 'NUMBA_DISABLE_JIT'):  # fmt: skip
        monkeypatch.delenv(name, raising=False)


def _one(check, verdict: str, *words: str, advice: str = '') -> Finding:
    found = [finding for finding in findings_of([check]) if finding.verdict == verdict]
    assert found, list(findings_of([check]))
    assert all(word in found[0].found for word in words), found[0]
    assert advice in found[0].advice
    assert bool(found[0].advice) == (verdict in ('warning', 'broken')) or verdict == 'note'
    return found[0]


def _distribution(folder: Path, name: str, version: str, *requires: str, code: str = '') -> None:
    info = folder / f'{name}-{version}.dist-info'
    info.mkdir(parents=True)
    lines = [f'Name: {name}', f'Version: {version}', *(f'Requires-Dist: {r}' for r in requires)]
    (info / 'METADATA').write_text('Metadata-Version: 2.1\n' + '\n'.join(lines) + '\n')
    (folder / f'{name}.py').write_text(code)


@pytest.mark.parametrize(
    ('check', 'name', 'value', 'verdict', 'word'),
    [
        (checks.distro, 'ROS_DISTRO', 'humble', 'broken', 'humble'),
        (checks.distro, 'AMENT_PREFIX_PATH', '/opt/ros/iron:/x', 'broken', '/opt/ros/iron'),
        (checks.distro, 'PYTHONPATH', '/x/lib/python3.8/site-packages', 'broken', '3.8'),
        (checks.distro, 'LD_LIBRARY_PATH', '/opt/ros/humble/lib', 'broken', '/opt/ros/humble'),
        (checks.middleware, 'RMW_IMPLEMENTATION', 'rmw_zenoh_cpp', 'warning', 'rmw_zenoh_cpp'),
        (checks.discovery_range, RANGE, 'SUBNET', 'warning', 'everybody on the network'),
        (checks.discovery_range, RANGE, 'OFF', 'broken', 'no node finds another'),
        (checks.discovery_range, RANGE, 'LOCALHSOT', 'broken', 'nearest: LOCALHOST'),
        (checks.discovery_range, 'ROS_LOCALHOST_ONLY', '1', 'warning', 'ROS_LOCALHOST_ONLY'),
        (checks.domain, 'ROS_DOMAIN_ID', '102', 'broken', '0 to 101, found '),
        (checks.domain, 'ROS_DOMAIN_ID', 'x', 'broken', 'found x'),
        (checks.compiler, 'NUMBA_DISABLE_JIT', '1', 'warning', 'off by NUMBA_DISABLE_JIT'),
    ],
)
def test_variables_that_break_something_are_named(check, name, value, verdict, word, monkeypatch):
    monkeypatch.setenv(name, '')
    sound = [*findings_of([check])]
    assert {finding.verdict for finding in sound} == {'ok'}
    monkeypatch.setenv(name, value)
    assert _one(check, verdict, word).check in {finding.check for finding in sound}


def test_a_jazzy_that_is_sourced_is_sound(monkeypatch):
    version = '.'.join(map(str, sys.version_info[:2]))
    monkeypatch.setenv('ROS_DISTRO', 'jazzy')
    monkeypatch.setenv('AMENT_PREFIX_PATH', '/opt/ros/jazzy')
    monkeypatch.setenv('PYTHONPATH', f'/opt/ros/jazzy/lib/python{version}/site-packages')
    (finding,) = checks.distro()
    assert (finding.verdict, finding.found) == ('ok', 'jazzy, sourced')


@pytest.mark.parametrize(
    ('end', 'version', 'words'),
    [('NEWEST', (3, 10), '3.11 to 3.10'), ('OLDEST', (3, 99), '3.99 to 3.13')],
)
def test_version_of_python_is_judged(end, version, words, monkeypatch):
    sound = _one(checks.python, 'ok')
    assert sound.found == f'{platform.python_version()}, {sys.executable}'
    monkeypatch.setattr(checks, end, version)
    _one(checks.python, 'broken', advice=words)


def test_packages_that_are_not_those_of_an_environment_are_a_warning(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, 'base_prefix', str(tmp_path))
    monkeypatch.setenv('VIRTUAL_ENV', sys.prefix)
    assert [finding.check for finding in checks.python()] == ['Python']
    monkeypatch.setenv('VIRTUAL_ENV', str(tmp_path))
    _one(checks.python, 'warning', f'{tmp_path} is active, but this is {sys.prefix}')
    monkeypatch.setattr(sys, 'base_prefix', sys.prefix)
    _one(checks.python, 'warning', 'no virtual environment')
    monkeypatch.setenv('ROS_DISTRO', 'jazzy')  # whose Python has its packages
    assert [finding.check for finding in checks.python()] == ['Python']


def test_a_range_that_is_chosen_and_safe_is_no_warning(monkeypatch):
    monkeypatch.setenv(RANGE, 'LOCALHOST')
    _one(checks.discovery_range, 'ok', 'this machine only')


def test_every_check_is_made():
    made = [
        check
        for module in (checks, discovery)
        for name, check in vars(module).items()
        if inspect.isgeneratorfunction(check) and not name.startswith('_')
    ]
    assert set(doctor.CHECKS) == set(made)


def test_packages_that_are_missing_old_or_broken_are_named(tmp_path, monkeypatch):
    _distribution(tmp_path, 'fake_auv', '1.0', 'not-there>=2', 'fake_old>=3', 'fake_bad>=1')
    _distribution(tmp_path, 'fake_old', '2.0')
    _distribution(tmp_path, 'fake_bad', '1.0', code='raise RuntimeError("built for another")')
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv('PYTHONPATH', str(tmp_path))
    monkeypatch.setattr(checks, 'OURS', ('fake_auv',))
    findings = list(checks.packages())
    assert [finding.found for finding in findings] == [
        'missing: not-there>=2',
        'wrong version: fake_old 2.0, not fake_old>=3',
        'fake_bad does not load: RuntimeError: built for another',
    ]
    assert all(finding.advice.startswith(checks.AGAIN) for finding in findings)


def test_a_sound_installation_is_called_one(monkeypatch):
    def absent(modules: list[str]) -> dict[str, str]:
        return {name: 'absent' for name in modules if find_spec(name) is None}

    monkeypatch.setattr(checks, '_failing', absent)  # to load them all takes long
    assert [finding.verdict for finding in checks.packages()] == ['ok']


@pytest.mark.parametrize('code', [0, 7])
def test_a_package_that_ends_the_process_is_named(code, tmp_path, monkeypatch):
    (tmp_path / 'fake_crash.py').write_text(f'import os\nos._exit({code})\n')
    monkeypatch.setenv('PYTHONPATH', str(tmp_path))
    failing = checks._failing(['json', 'fake_crash', 'csv'])
    assert failing == {'fake_crash': f'it ends the process with exit code {code}'}


def test_absent_compiler_is_a_warning(monkeypatch):
    monkeypatch.setattr(checks, '_version', lambda name: None)
    _one(checks.compiler, 'warning', 'numba is not installed')


def test_cache_that_cannot_be_written_is_a_warning(tmp_path, monkeypatch):
    monkeypatch.setenv('AUV_GVC_CACHE_DIR', str(tmp_path / 'good'))
    assert checks._kept().verdict == 'ok'
    assert ', empty: ' in checks._kept().found
    (Path(checks._kept().found.partition(',')[0]) / 'x.nbi').touch()
    assert ', empty: ' not in checks._kept().found
    (tmp_path / 'file').touch()  # not a folder: nobody can write into it, not even root
    monkeypatch.setenv('AUV_GVC_CACHE_DIR', str(tmp_path / 'file'))
    _one(checks.compiler, 'warning', 'at every start', advice='AUV_GVC_CACHE_DIR')


def test_another_auv_in_front_is_a_warning(tmp_path, monkeypatch):
    other = tmp_path / 'auv'
    other.write_text('#!/bin/sh\n')
    other.chmod(0o755)
    monkeypatch.setenv('PATH', str(tmp_path))
    _one(checks.executables, 'warning', str(other))
    monkeypatch.setenv('PATH', str(Path(sys.executable).parent))
    assert {finding.verdict for finding in checks.executables()} == {'ok'}


@pytest.mark.parametrize(
    ('free', 'verdict'),
    [(199 << 20, 'broken'), (200 << 20, 'warning'), (2 << 30, 'warning'), (3 << 30, 'ok')],
)
def test_full_disk_is_said(free, verdict, monkeypatch):
    monkeypatch.setattr(shutil, 'disk_usage', lambda _: Usage(1 << 40, 0, free))
    room = 'make room' if verdict != 'ok' else ''
    _one(checks.disk, verdict, f'{free / 2**30:.1f} GB free here', advice=room)


def test_left_over_segments_are_counted_and_those_in_use_are_not(tmp_path, monkeypatch):
    for i in range(60):
        (tmp_path / f'fastrtps_{i}').write_bytes(b'x')
    (tmp_path / 'sem.fastdds_0').touch()
    (tmp_path / 'somebody_else').touch()
    system, size = ctypes.CDLL(None), ctypes.c_size_t(1)
    system.mmap.restype = ctypes.c_void_p
    with (tmp_path / 'fastrtps_1').open('rb') as file:  # mapped and closed, as by Fast DDS
        how = mmap.PROT_READ, mmap.MAP_SHARED, file.fileno(), ctypes.c_long(0)
        mapped = ctypes.c_void_p(system.mmap(None, size, *how))
    with (tmp_path / 'fastrtps_0').open():
        left = checks.left_over(tmp_path)
    system.munmap(mapped, size)
    assert len(left) == 59
    assert not {tmp_path / 'fastrtps_0', tmp_path / 'fastrtps_1'} & {*left}
    found = _one(lambda: checks.shared_memory(tmp_path), 'warning', '61 files')
    patterns = found.advice.partition('rm ')[2].split()
    assert all(any(path.match(pattern) for pattern in patterns) for path in left)
    ended = Path('/proc/0'), Path(f'/proc/{os.getpid()}')
    with (tmp_path / 'fastrtps_0').open(), monkeypatch.context() as patched:
        patched.setattr(Path, 'glob', lambda *_: ended)
        assert len(checks.left_over(tmp_path)) == 60, 'one that has ended hides no other'
    with monkeypatch.context() as patched:  # a process that ends meanwhile removes its own
        patched.setattr(
            checks, '_in_use', lambda folder: (folder / 'fastrtps_2').unlink() or set[str]()
        )
        assert len(checks.left_over(tmp_path)) == 60
    monkeypatch.setattr(os, 'getuid', lambda: -1)  # nobody may remove those of others
    assert checks.left_over(tmp_path) == {}


@pytest.mark.parametrize(
    ('free', 'verdict'),
    [(7 << 20, 'broken'), (8 << 20, 'warning'), (64 << 20, 'warning'), (65 << 20, 'ok')],
)
def test_full_or_absent_shared_memory_is_said(free, verdict, tmp_path, monkeypatch):
    _one(lambda: checks.shared_memory(tmp_path / 'gone'), 'note', 'is not there')
    monkeypatch.setattr(shutil, 'disk_usage', lambda _: Usage(1 << 40, 0, free))
    found = _one(lambda: checks.shared_memory(tmp_path), verdict, f'{free >> 20} MB free')
    assert ('end what fills it' in found.advice) == (verdict != 'ok')
    (tmp_path / 'fastdds_0').touch()
    few = 'note' if verdict == 'ok' else 'warning'
    assert [*findings_of([lambda: checks.shared_memory(tmp_path)])][1].verdict == few


@pytest.mark.parametrize(
    ('limit', 'verdict'), [(127, 'broken'), (128, 'warning'), (1023, 'warning'), (1024, 'ok')]
)
@pytest.mark.parametrize('hard', [1 << 20, resource.RLIM_INFINITY])
def test_few_open_files_are_said(limit, verdict, hard, monkeypatch):
    monkeypatch.setattr(resource, 'getrlimit', lambda _: (limit, hard))
    _one(checks.files, verdict, f'{limit} per process')


def test_no_limit_of_open_files_is_fine(monkeypatch):
    monkeypatch.setattr(resource, 'getrlimit', lambda _: (resource.RLIM_INFINITY,) * 2)
    _one(checks.files, 'ok', 'no limit')


def test_clock_before_the_program_was_made_is_said(monkeypatch):
    monkeypatch.setattr(checks.time, 'time', lambda: 1e6)
    _one(checks.clock, 'warning', '1970')


def test_single_core_and_absent_programs_are_said(monkeypatch):
    monkeypatch.setattr(os, 'sched_getaffinity', lambda _: {0})
    _one(checks.cores, 'warning', '1', advice='--composed')
    monkeypatch.setattr(shutil, 'which', lambda _: None)
    assert [finding.check for finding in checks.programs()] == ['chromium', 'ros2']
    for browser in ('chromium', 'google-chrome'):
        monkeypatch.setattr(shutil, 'which', {browser: '/usr/bin/browser'}.get)
        assert [finding.check for finding in checks.programs()] == ['ros2']
    monkeypatch.setattr(shutil, 'which', str)
    assert [*checks.programs()] == []


def test_participants_that_cannot_start_are_broken(tmp_path, monkeypatch):
    (tmp_path / 'rclpy').mkdir()
    (tmp_path / 'rclpy' / '__init__.py').write_text('raise ImportError("no such library")\n')
    monkeypatch.setenv('PYTHONPATH', str(tmp_path))
    _one(discovery.discovery, 'broken', 'cannot start: ImportError: no such library')


def test_a_participant_that_hangs_is_ended_and_named(monkeypatch):
    monkeypatch.setattr(discovery, 'STARTS', 0.0)
    monkeypatch.setattr(discovery, 'PATIENCE', 0.1)
    process = subprocess.Popen(['sleep', '600'], stdout=-1, stderr=-1, text=True)
    try:
        assert 'did not end within' in discovery._answer(process)['why']
        assert process.returncode == -signal.SIGKILL
    finally:
        process.kill()


@pytest.mark.parametrize(
    ('flags', 'advice'),
    [
        ('0x1048', ['ip link set lo up']),
        ('0x49', ['allow UDP', 'ip link set lo multicast on']),
        ('0x1049', ['allow UDP']),
        (None, ['allow UDP']),
    ],
)
def test_what_keeps_participants_apart_is_what_the_loopback_lacks(
    flags, advice, tmp_path, monkeypatch
):
    monkeypatch.setattr(discovery, 'LOOPBACK', tmp_path)
    if flags:
        (tmp_path / 'flags').write_text(f'{flags}\n')
    parts = discovery._what_to_do('').split('; ')
    assert [part[: len(begin)] for part, begin in zip(parts, advice, strict=True)] == advice


@pytest.mark.parametrize(('second', 'verdict'), [(0.71, 'ok'), (None, 'broken')])
def test_participants_have_to_find_each_other_both(second, verdict, monkeypatch):
    took = {discovery.FIRST: 0.2, discovery.SECOND: second}
    monkeypatch.setattr(discovery, '_start', lambda *given: given)
    monkeypatch.setattr(discovery, '_answer', lambda given: {'took': took[given[1]]})
    found = _one(discovery.discovery, verdict)
    assert ('each other in 0.7 s' in found.found) == (second is not None)


def test_who_is_in_a_domain_matters_where_it_was_chosen(monkeypatch):
    asked = []
    monkeypatch.setattr(discovery, '_start', lambda *given: asked.append(given[-1]))
    for name in PROFILES:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(discovery, '_answer', lambda _: {'seen': ['/one', '/other']})
    _one(discovery.peers, 'note', '/one, /other')
    monkeypatch.setenv('ROS_DOMAIN_ID', '7')
    _one(discovery.peers, 'warning', 'domain 7 is in use by /one, /other', advice='unset ROS_')
    monkeypatch.setenv(PROFILES[0], '/etc/own.xml')
    _one(discovery.peers, 'warning')
    monkeypatch.setenv(RANGE, 'SUBNET')
    _one(discovery.peers, 'warning')
    assert asked == [loopback(), loopback(), {RANGE: 'LOCALHOST'}, {RANGE: 'SUBNET'}]


def test_a_check_that_fails_is_a_finding_and_the_others_go_on():
    def bad_check():
        raise OSError('gone')

    found = list(findings_of([bad_check, checks.cores]))
    assert found[0].verdict == 'broken'
    assert 'bad check: could not be looked at: OSError: gone' in found[0].line()
    assert found[1].check == 'cores'


@pytest.mark.parametrize(('verdict', 'code'), [('ok', 0), ('warning', 0), ('broken', 1)])
def test_exit_code_and_document(verdict, code, monkeypatch, capsys):
    monkeypatch.setattr(doctor, 'CHECKS', (lambda: [Finding('x', verdict, 'y', 'z')],))
    for options in ([], ['--json']):
        with pytest.raises(SystemExit) if code else nullcontext(None) as end:
            main.main(['doctor', *options])
        assert end is None or end.value.code == 1
        out = capsys.readouterr().out
        if not options:
            assert f'{verdict:<8}  x: y' in out
            assert ('nothing is broken' in out) == (not code)
    document = json.loads(out)
    assert document['findings'] == [{'check': 'x', 'verdict': verdict, 'found': 'y', 'advice': 'z'}]
    assert (document['broken'], document['warnings']) == (code, int(verdict == 'warning'))


def test_it_runs_where_everything_is_broken(tmp_path):
    for name in ('numpy', 'yaml', 'jsonschema', 'rich', 'rclpy', 'psutil', 'numba'):
        (tmp_path / f'{name}.py').write_text('raise ImportError("broken on purpose")\n')
    ended = _auv(tmp_path, 'doctor', '--json')
    assert ended.returncode == 1, ended.stderr
    document = json.loads(ended.stdout)
    broken = ' '.join(f['found'] for f in document['findings'] if f['verdict'] == 'broken')
    assert all(f'{name} does not load' in broken for name in ('numpy', 'yaml', 'rclpy'))
    assert len(ended.stderr.splitlines()) == 1
    refused = _auv(tmp_path, 'simulate', 'case1')
    assert refused.returncode == 1
    assert refused.stderr.splitlines() == ['broken on purpose: see auv doctor']


def _auv(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, '-m', 'auv_analysis.cli.main', *arguments]
    environ = {**os.environ, 'PYTHONPATH': str(folder)}
    return subprocess.run(
        command, cwd=folder, env=environ, capture_output=True, text=True, check=False
    )


def test_nodes_that_are_not_installed_are_named(monkeypatch):
    def missing(package, name):
        if name != 'plant_node':
            raise NodeDiedError(name)

    assert {finding.verdict for finding in checks.executables()} == {'ok'}
    monkeypatch.setattr(supervisor, 'executable', missing)
    found = _one(checks.executables, 'broken', 'not installed: ', 'setpoint_node')
    assert 'plant_node' not in found.found
