"""What `auv info` prints: each count beside its topic, each range beside its field."""

import json
from pathlib import Path

from helpers.damaged_bags import UPRIGHT
from helpers.made_messages import ODOMETRY, SECOND, STRING, Bag, odometry, serialized

from auv_analysis.cli import main
from auv_analysis.cli.info import _print_info

DOCUMENT = {
    'bag': 'some.mcap', 'messages': 12, 'duration': 2.5,
    'topics': {
        '/odom': {'type': 'nav_msgs/msg/Odometry', 'messages': 7},
        '/wrench': {'type': 'geometry_msgs/msg/WrenchStamped', 'messages': 5},
    },
    'namespace': '/auv', 'attachments': ['params.yaml', 'vehicle.yaml'],
    'candidates': {'odometry': ['/odom', '/pose'], 'wrench': []},
    'fields': {
        '/odom': {
            'twist.u': {'values': 7, 'least': -1.25, 'largest': 3.5},
            'name': {'values': 6, 'least': None, 'largest': None},
        }
    },
    'mapping': 'odometry: /odom', 'notes': ['one is odd'],
}  # fmt: skip


def printed(capsys, **changes: object) -> list[list[str]]:
    _print_info(DOCUMENT | changes)
    return [line.split() for line in capsys.readouterr().out.splitlines() if line.split()]


def test_every_number_stands_beside_its_name(capsys) -> None:
    assert printed(capsys) == [
        ['some.mcap:', '12', 'messages,', '2.5', 's'],
        ['topic', 'type', 'messages'],
        ['/odom', 'nav_msgs/msg/Odometry', '7'],
        ['/wrench', 'geometry_msgs/msg/WrenchStamped', '5'],
        ['namespace:', '/auv'],
        ['attachments:', 'params.yaml,', 'vehicle.yaml'],
        ['could', 'be', 'mapped', 'as', 'odometry:', '/odom,', '/pose'],
        ['topic', 'field', 'values', 'least', 'largest'],
        ['/odom', 'twist.u', '7', '-1.25', '3.5'],
        ['/odom', 'name', '6'],
        ['note:', 'one', 'is', 'odd'],
        ['a', 'mapping', 'file', 'to', 'begin', 'with,', 'for', '--map:'],
        ['odometry:', '/odom'],
    ]


def test_what_a_bag_does_not_have_is_left_out(capsys) -> None:
    bare = printed(
        capsys, duration=None, namespace=None, attachments=[], fields={}, mapping='', notes=[]
    )
    assert bare[0][-2:] == ['no', 'messages']
    assert ['attachments:', 'none'] in bare
    assert [words[0] for words in bare[4:]] == ['attachments:', 'could']


def test_a_topic_that_was_silent_is_listed_with_none(tmp_path: Path, capsys) -> None:
    bag = Bag(tmp_path / 'some.mcap')
    bag.channel('/silent', STRING)
    for second in (5, 6, 8):
        ns = second * SECOND
        bag.add('/odom', ODOMETRY, ns, serialized(odometry(ns, UPRIGHT)))
    main.main(['info', str(bag.close()), '--json'])
    document = json.loads(capsys.readouterr().out)
    assert document['topics'] == {
        '/odom': {'type': ODOMETRY, 'messages': 3},
        '/silent': {'type': STRING, 'messages': 0},
    }
    assert (document['messages'], document['duration']) == (3, 3.0)
    assert (document['files'], document['attachments']) == (['some.mcap'], [])
    assert document['candidates']['odometry'] == ['/odom']
    assert 'topic: /odom' in document['mapping']
