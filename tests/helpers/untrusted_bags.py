"""Small bags as a stranger might send them: any text in the files that travel with them."""

from pathlib import Path
from typing import Any

import numpy as np
import yaml
from helpers.made_messages import ODOMETRY, Bag, odometry, serialized, stamped

from auv_analysis import load_scenario

STEP = 10_000_000
SCENARIO = load_scenario('case1')
GAINS = {f'gains.{name}': [1.0] for name in ('k_D', 'k_I', 'Lambda', 'Gamma')}
WRENCH = 'geometry_msgs/msg/WrenchStamped'
TWIST = 'geometry_msgs/msg/TwistStamped'


def write(
    path: Path,
    *,
    law: Any = 'gvc',
    controller: str = 'gvc',
    vehicle: str = 'herman2018',
    remark: str = '',
    topic: str = '',
    samples: int = 20,
) -> Path:
    """Bag of a vehicle that drifts, with what its files say."""
    nodes = {
        'plant_node': {'step': STEP / 1e9},
        'controller_node': {'law': law, **GAINS},
        'recorder_node': {'bag': f'somewhere/{controller}'},
    }
    parameters = {name: {'ros__parameters': values} for name, values in nodes.items()}
    bag = Bag(path)
    bag.attach('params.yaml', yaml.safe_dump(parameters))
    bag.attach('vehicle.yaml', yaml.safe_dump({**SCENARIO.vehicle_data, 'name': vehicle}))
    bag.attach('scenario.yaml', yaml.safe_dump({'name': 'case1', 'remark': remark}))
    bag.channel('/odom', ODOMETRY)
    bag.channel('/cmd_vel', TWIST)
    bag.channel('/wrench', WRENCH)
    if topic:
        bag.channel(topic, WRENCH)
    for k in range(samples):
        at, moving = k * STEP, 0.1 * np.arange(1.0, 7.0) * np.sin(0.1 * k)
        state = np.array([0.1 * k, 0, 0, 1, 0, 0, 0, *moving])
        bag.add('/odom', ODOMETRY, at, serialized(odometry(at, state)))
        bag.add('/cmd_vel', TWIST, at, serialized(stamped('Twist', at, moving)))
        force = serialized(stamped('Wrench', at, np.arange(6.0)))
        for name in filter(None, ('/wrench', topic)):
            bag.add(name, WRENCH, at, force)
    return bag.close()
