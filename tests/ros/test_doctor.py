"""`auv doctor` on real participants: discovery on the loopback, and who is in the domain."""

import pytest
from helpers.node_processes import Peer, fresh_domain
from helpers.patience import patience

from auv_analysis.doctor import discovery


def test_two_participants_find_each_other() -> None:
    (finding,) = discovery.discovery()
    assert (finding.check, finding.verdict) == ('discovery', 'ok'), finding


def test_a_foreign_node_in_the_domain_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    domain = fresh_domain()
    monkeypatch.setenv('ROS_DOMAIN_ID', str(domain))
    monkeypatch.setattr(discovery, 'LOOKS', patience(discovery.LOOKS))
    peer = Peer(domain)
    try:
        (finding,) = discovery.peers()
    finally:
        peer.close()
    assert finding.verdict == 'warning'
    assert f'domain {domain} is in use by /test_peer' in finding.found
