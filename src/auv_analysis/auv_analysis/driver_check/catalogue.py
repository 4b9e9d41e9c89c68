"""Every check by its id, in the order of the report."""

from typing import NamedTuple

from auv_dynamics.vehicle import DOFS


class Check(NamedTuple):
    """A check: the group that it stands in and what it looks at."""

    group: str
    title: str


GROUPS = {
    'endpoints': 'Who is there',
    'qos': 'Quality of service',
    'values': 'Frames and numbers',
    'time': 'Rate and stamps',
    'motion': 'Twist against pose',
    'response': 'Answer to a wrench',
}
CHECKS = {
    'odom_publisher': Check('endpoints', 'publisher of odom'),
    'wrench_subscriber': Check('endpoints', 'subscriber of wrench'),
    'wrench_publishers': Check('endpoints', 'others that command'),
    'clock': Check('endpoints', 'simulated time'),
    'qos_controller': Check('qos', 'odom to the controller'),
    'qos_recorder': Check('qos', 'odom to the recorder'),
    'qos_wrench': Check('qos', 'wrench to the driver'),
    'frames': Check('values', 'frame ids'),
    'finite': Check('values', 'finite numbers'),
    'quaternion_norm': Check('values', 'unit quaternion'),
    'upright': Check('values', 'attitude of a vehicle afloat'),
    'depth': Check('values', 'direction of z'),
    'speeds': Check('values', 'speeds that are believed'),
    'jumps': Check('values', 'steps between messages'),
    'rate': Check('time', 'rate'),
    'gaps': Check('time', 'longest silence'),
    'stamps': Check('time', 'order of the stamps'),
    'age': Check('time', 'age of the stamps'),
    'drift': Check('time', 'speed of their clock'),
    'twist_frame': Check('motion', 'axes of twist.linear'),
    'angular_frame': Check('motion', 'axes of twist.angular'),
    **{f'axis_{dof}': Check('motion', f'{dof} by twist and pose') for dof in DOFS},
    'actuation': Check('response', 'wrenches that were sent'),
    **{f'response_{dof}': Check('response', f'answer in {dof}') for dof in DOFS},
    'response_delay': Check('response', 'delay of the answer'),
    'silence': Check('response', 'zero when commands cease'),
}
