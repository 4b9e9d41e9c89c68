"""`make audit`: what is known to be vulnerable, and that silence is no good news."""

import json
import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import pytest
from audit.run import FINE, NOT_AUDITED, ROOT, VULNERABLE, verdict
from helpers.needs import need

ADVISORY = {'id': 'CVE-2099-1', 'fix_versions': ['99.0'], 'aliases': ['GHSA-made-up']}
REFUSED = (
    'Traceback (most recent call last):\n  File "x", line 1, in <module>\n'
    'requests.exceptions.ConnectionError: Failed to establish a new connection\n'
)


def answer(*entries: dict) -> str:
    return json.dumps({'dependencies': list(entries), 'fixes': []})


def test_packages_without_advisories_are_fine() -> None:
    code, lines = verdict(answer({'name': 'a', 'version': '1', 'vulns': []}), '')
    assert (code, lines) == (FINE, ['audited: 1 packages, no known vulnerabilities'])


def test_a_vulnerable_package_is_named_with_what_fixes_it() -> None:
    bad = {'name': 'b', 'version': '2', 'vulns': [ADVISORY, {**ADVISORY, 'fix_versions': []}]}
    skipped = {'name': 'c', 'skip_reason': 'not found'}
    code, lines = verdict(answer({'name': 'a', 'version': '1', 'vulns': []}, bad, skipped), '')
    assert code == VULNERABLE
    assert lines == [
        'audited: 2 packages, 2 known vulnerabilities',
        'b 2: CVE-2099-1, GHSA-made-up, fixed in 99.0',
        'b 2: CVE-2099-1, GHSA-made-up, fixed in no version',
        'not known to the service: c',
    ]


@pytest.mark.parametrize('said', ['', '{', '[]', '{"fixes": []}', 'null', '<html>'])
def test_what_is_no_whole_answer_is_no_audit(said: str) -> None:
    code, lines = verdict(said, REFUSED)
    assert code == NOT_AUDITED
    assert len(lines) == 1
    assert lines[0].startswith('not audited: the advisory service did not answer (requests.')


def test_nothing_found_is_no_audit() -> None:
    assert verdict(answer(), '') == (NOT_AUDITED, ['not audited: no package was found'])
    assert verdict('', '')[1] == ['not audited: the advisory service did not answer (no answer)']


class Service(BaseHTTPRequestHandler):
    """OSV as it answers, which knows one advisory."""

    def do_POST(self) -> None:
        asked = json.loads(self.rfile.read(int(self.headers['Content-Length'])))
        package = asked['package']
        affected = {
            'package': package,
            'ranges': [{'type': 'ECOSYSTEM', 'events': [{'introduced': '0'}, {'fixed': '99.0'}]}],
            'versions': [asked['version']],
        }
        known = {
            'id': 'GHSA-made-up', 'aliases': ['CVE-2099-1'], 'summary': 'made up', 'details': '',
            'published': '2099-01-01T00:00:00Z', 'affected': [affected],
        }  # fmt: skip
        vulnerable = package['name'] == self.server.vulnerable
        body = json.dumps({'vulns': [known]} if vulnerable else {}).encode()
        self.send_response(200)
        self.send_header('Content-Type', 'application/json')
        self.send_header('Content-Length', str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: object) -> None:
        """Keep quiet."""


@contextmanager
def service(vulnerable: str) -> Iterator[str]:
    """Address of a service on the loopback."""
    server = HTTPServer(('127.0.0.1', 0), Service)
    server.vulnerable = vulnerable
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield f'http://127.0.0.1:{server.server_port}/v1/query'
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


@pytest.mark.long
def test_pip_audit_itself_finds_fails_and_passes(tmp_path: Path) -> None:
    made = tmp_path / 'audit'
    subprocess.run([sys.executable, '-m', 'venv', str(made)], check=True)
    python = made / 'bin/python'
    install = [str(python), '-m', 'pip', 'install', '--quiet', '-r', 'requirements-audit.txt']
    need('pip-audit', not subprocess.run(install, cwd=ROOT, check=False).returncode)

    def audit(url: str) -> subprocess.CompletedProcess:
        command = [str(python), 'tests/audit/run.py', '--python', str(python), '--url', url]
        environ = {**os.environ, 'NO_PROXY': '127.0.0.1'}
        return subprocess.run(
            command, cwd=ROOT, env=environ, check=False, capture_output=True, text=True
        )

    with service('packaging') as url:
        found = audit(url)
    assert found.returncode == VULNERABLE, found.stderr
    assert 'CVE-2099-1, GHSA-made-up, fixed in 99.0' in found.stdout
    with service('') as url:
        passed = audit(url)
    assert passed.returncode == FINE, passed.stdout
    assert 'no known vulnerabilities' in passed.stdout
    silent = audit(url)  # the service is gone
    assert silent.returncode == NOT_AUDITED
    assert silent.stdout.startswith('not audited: the advisory service did not answer')
    assert len(silent.stdout.splitlines()) == 1
    assert silent.stderr == ''
