"""`auv doctor` on real participants: discovery on the loopback, and who is in the domain."""

import time

import pytest
from helpers.node_processes import Peer, fresh_domain
from helpers.patience import patience

from auv_analysis.doctor import discovery


def test_two_participants_find_each_other() -> None:
    until = time.monotonic() + patience()
    (finding,) = discovery.discovery()
    while finding.verdict == 'broken' and time.monotonic() < until:
        (finding,) = discovery.discovery()  # as below: neither waits for the other for ever
    assert (finding.check, finding.verdict) == ('discovery', 'ok'), finding


def test_a_foreign_node_in_the_domain_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    domain = fresh_domain()
    monkeypatch.setenv('ROS_DOMAIN_ID', str(domain))
    monkeypatch.setattr('auv_analysis.graph.domain.ANNOUNCED', 1.0)  # s, and again until it is seen
    until = time.monotonic() + patience()
    peer = Peer(domain)
    try:
        (finding,) = discovery.peers()
        while finding.verdict == 'ok' and time.monotonic() < until:
            (finding,) = discovery.peers()  # a machine that stood still had no time to answer
    finally:
        peer.close()
    assert finding.verdict == 'warning'
    assert f'domain {domain} is in use by /test_peer' in finding.found
