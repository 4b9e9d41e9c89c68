"""Known vulnerabilities of the packages that are installed: `make audit`.

pip-audit asks the OSV service for each package of the environment that `make setup` has made. Exit
code 0: none is known; 1: some are, a line each; 3: nothing was audited, one line says why.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
FINE, VULNERABLE, NOT_AUDITED = 0, 1, 3
SITE = "import sysconfig; print(sysconfig.get_path('purelib'))"


def arguments(given: list[str] | None = None) -> argparse.Namespace:
    """What was asked for."""
    parser = argparse.ArgumentParser(description='Known vulnerabilities of installed packages.')
    python = ROOT / '.venv/bin/python'
    parser.add_argument('--python', type=Path, default=python, help='whose packages')
    parser.add_argument('--url', help='of another OSV service, such as a mirror')
    return parser.parse_args(given)


def packages(python: Path) -> str:
    """Folder of the packages of an interpreter."""
    return subprocess.run(
        [str(python), '-c', SITE], check=True, capture_output=True, text=True
    ).stdout.strip()


def ask(folder: str, url: str | None) -> tuple[str, str]:
    """What pip-audit says of the packages of a folder, and what it complains of."""
    command = [sys.executable, '-m', 'pip_audit', '--path', folder, '--skip-editable']
    command += ['--vulnerability-service', 'osv', *(['--osv-url', url] if url else [])]
    command += ['--format', 'json', '--desc', 'off', '--progress-spinner', 'off']
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    return done.stdout, done.stderr


def verdict(answer: str, complaint: str) -> tuple[int, list[str]]:
    """Exit code and lines of what pip-audit has said.

    It exits with 1 both for a vulnerability and for a service that does not answer: only a whole
    answer counts.
    """
    try:
        listed = json.loads(answer)['dependencies']
    except (ValueError, KeyError, TypeError):
        lines = [line.strip() for line in complaint.splitlines() if line.strip()]
        why = lines[-1] if lines else 'no answer'
        return NOT_AUDITED, [f'not audited: the advisory service did not answer ({why})']
    skipped = [entry['name'] for entry in listed if 'skip_reason' in entry]
    audited = [entry for entry in listed if 'skip_reason' not in entry]
    if not audited:
        return NOT_AUDITED, ['not audited: no package was found']
    found = [line for entry in audited for line in _lines(entry)]
    lines = [
        f'audited: {len(audited)} packages, {len(found) or "no"} known vulnerabilities',
        *found,
    ]
    if skipped:
        lines.append(f'not known to the service: {", ".join(sorted(skipped))}')
    return VULNERABLE if found else FINE, lines


def _lines(entry: dict[str, Any]) -> list[str]:
    """A line per vulnerability of a package."""
    return [
        f'{entry["name"]} {entry["version"]}: {", ".join([known["id"], *known["aliases"]])}, '
        f'fixed in {", ".join(known["fix_versions"]) or "no version"}'
        for known in entry['vulns']
    ]


def main() -> int:
    """Audit, say what came out; the exit code."""
    options = arguments()
    code, lines = verdict(*ask(packages(options.python), options.url))
    print('\n'.join(lines))
    return code


if __name__ == '__main__':
    sys.exit(main())
