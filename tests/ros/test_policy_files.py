"""The SROS 2 policy as a file: the schema, nothing in bulk, who may do what moves a vehicle."""

import os
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from xml.etree import ElementTree

import pytest
from helpers import policies
from helpers.needs import need


def test_policy_fits_the_schema() -> None:
    assert policies.faults(policies.tree()) == []


@pytest.mark.parametrize(
    ('change', 'fault'),
    [
        (lambda root: root.set('version', '0.1.0'), 'version 0.1.0'),
        (lambda root: root[0].append(ElementTree.Element('context')), 'context in enclaves'),
        (lambda root: root[0][0].attrib.pop('path'), 'enclave without path'),
        (lambda root: next(root.iter('topics')).set('publish', 'YES'), 'topics: publish="YES"'),
        (lambda root: next(root.iter('topics')).set('read', 'ALLOW'), 'topics with read'),
        (lambda root: next(root.iter('profile')).append(ElementTree.Element('topic')),
         'topic in profile'),
        (lambda root: setattr(next(root.iter('topic')), 'text', ''), 'topic that is no name'),
    ],
)  # fmt: skip
def test_what_does_not_fit_the_schema_is_found(change, fault) -> None:
    root = policies.tree()
    change(root)
    assert fault in ' '.join(policies.faults(root))


def test_nothing_is_allowed_in_bulk_or_twice() -> None:
    root = policies.tree()
    for profile in root.iter('profile'):
        names = [(group.tag, *sorted(group.attrib.items()), entry.text)
                 for group in profile for entry in group]  # fmt: skip
        names = [tuple(part for part in name if 'base' not in str(part)) for name in names]
        assert len(names) == len(set(names)), profile.get('node')
        assert not [name for name in names if '*' in name[-1]]
    assert not [g for g in root.iter() if 'DENY' in g.attrib.values()]


def test_who_may_move_the_vehicle_or_say_how_it_moves() -> None:
    listed = policies.allowed(policies.tree())
    listed.pop('/auv_gvc/composed_graph')
    for topic, allowed in (
        ('/wrench', ['controller_node', 'auv_check_driver']),
        ('/odom', ['plant_node', 'frame_converter_node']),
    ):
        who = [node for nodes in listed.values() for node, entries in nodes.items()
               if ('publish', topic) in entries]  # fmt: skip
        assert sorted(who) == sorted(allowed)


def test_sros2_takes_the_policy_where_it_is_installed() -> None:
    need('ros2', find_spec('sros2'))
    policy = import_module('sros2.policy')
    assert policy.load_policy(policies.POLICY).getroot().tag == 'policy'


def test_policy_is_installed_with_the_package() -> None:
    setup = Path(policies.FOLDER.parents[1] / 'src/auv_analysis/setup.py').read_text()
    for folder in ('', '/profiles', '/common'):
        assert f"glob('config/security{folder}/*.xml')" in setup
    assert os.path.samefile(policies.FOLDER, Path(policies.FOLDER.parents[1]) /
                            'src/auv_analysis/config/security')  # fmt: skip
