"""Discovery: whether two participants find each other here, and who is in the domain.

A participant is this module run as a program: what the middleware may bring down stays there.
"""

import json
import os
import random
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from auv_analysis.doctor.checks import Finding

FIRST, SECOND, LOOKING = 'auv_doctor_first', 'auv_doctor_second', 'auv_doctor'
PATIENCE = 10.0  # s for two participants to find each other; they take 0.2
STARTS = 30.0  # s for a process to load the middleware, on a busy machine
LOOPBACK = Path('/sys/class/net/lo')
MULTICAST = 0x1000  # IFF_MULTICAST
STAYS = 1.5  # s after a participant has found the other, so that the other finds it as well
LOOK = 0.1  # s


def discovery() -> Iterator[Finding]:
    """Let two participants look for each other on the loopback, in a domain of their own."""
    from auv_analysis.graph.domain import LARGEST, is_free
    from auv_dynamics.ros.security import loopback

    domains = [domain for domain in range(1, LARGEST + 1) if is_free(domain)]
    if not domains:
        advice = 'end what holds the ports 7400 and above; see ss -ulpn'
        yield Finding('discovery', 'broken', f'no free domain from 1 to {LARGEST}', advice)
        return
    domain = random.choice(domains)
    pair = [
        _start(domain, one, other, PATIENCE, loopback())
        for one, other in ((FIRST, SECOND), (SECOND, FIRST))
    ]
    answers = [_answer(process) for process in pair]
    took = [answer.get('took') for answer in answers]
    if None not in took:
        seconds = max(t for t in took if t is not None)
        found = f'two participants found each other in {seconds:.1f} s, domain {domain}'
        yield Finding('discovery', 'ok', found)
        return
    why = next((answer['why'] for answer in answers if 'why' in answer), '')
    found = why or f'two participants on the loopback did not find each other in {PATIENCE:g} s'
    yield Finding('discovery', 'broken', found, _what_to_do(why))


def _what_to_do(why: str) -> str:
    if why:
        return 'make setup; the check of packages says more'
    advice = 'allow UDP on 127.0.0.1, ports 7400 to 32767, in the firewall'
    try:
        flags = int((LOOPBACK / 'flags').read_text(), 16)
    except (OSError, ValueError):
        return advice
    if not flags & 1:
        return 'ip link set lo up'
    return advice if flags & MULTICAST else f'{advice}; ip link set lo multicast on'


def peers() -> Iterator[Finding]:
    """Who is in the domain that commands join here."""
    from auv_analysis.graph.domain import ANNOUNCED, VARIABLE, joined_domain
    from auv_dynamics.files.errors import InputError
    from auv_dynamics.ros.security import local

    try:
        domain = joined_domain(None)
    except InputError:
        return  # said elsewhere
    answer = _answer(_start(domain, LOOKING, '', ANNOUNCED, local()))
    if 'why' in answer:
        return  # said of discovery
    nodes = answer['seen']
    if not nodes:
        yield Finding('nodes there', 'ok', f'nobody in domain {domain}')
        return
    found = f'domain {domain} is in use by {", ".join(nodes)}'
    if os.environ.get(VARIABLE):
        advice = f'unset {VARIABLE}, and auv run takes a free one; or end those nodes'
        yield Finding('nodes there', 'warning', found, advice)
    else:
        yield Finding('nodes there', 'note', f'{found}; auv watch and check-driver join it')


def _start(
    domain: int, name: str, other: str, seconds: float, local: dict[str, str]
) -> subprocess.Popen[str]:
    command = [sys.executable, '-m', 'auv_analysis.doctor.discovery']
    return subprocess.Popen(
        [*command, str(domain), name, other, str(seconds)],
        env={**os.environ, **local, 'ROS_DOMAIN_ID': str(domain)},
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, errors='replace',
    )  # fmt: skip


def _answer(process: subprocess.Popen[str]) -> dict[str, Any]:
    """Output of a participant; `why` where it could not take part."""
    try:
        out, errors = process.communicate(timeout=STARTS + PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        return {'why': f'a participant did not end within {STARTS + PATIENCE:g} s'}
    if process.returncode:
        lines = [line.strip() for line in errors.splitlines() if line.strip()]
        said = lines[-1] if lines else f'exit code {process.returncode}'
        return {'why': f'a participant cannot start: {said}'}
    return json.loads(out.splitlines()[-1])


def main() -> None:
    """Take part in a domain: DOMAIN NAME OTHER SECONDS.

    Prints how long OTHER took to be found, and all that were; without one it looks for so long.
    """
    from auv_dynamics.ros.participant import Participant, bare_node

    domain, name, other, seconds = sys.argv[1:]
    participant = Participant(int(domain), bare_node(name))
    began = time.monotonic()
    took, seen = None, set()
    while time.monotonic() - began < float(seconds) and took is None:
        participant.spin(LOOK)
        seen |= participant.nodes()
        if other and f'/{other}' in seen:
            took = time.monotonic() - began
    if took is not None:
        participant.spin(STAYS)
    participant.close()
    print(json.dumps({'took': took, 'seen': sorted(seen - {f'/{name}'})}))


if __name__ == '__main__':
    main()
