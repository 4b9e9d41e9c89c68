"""Options of `auv check-driver`."""

import argparse

from auv_dynamics.vehicle import DOFS


def add_options(command: argparse.ArgumentParser) -> None:
    """Add the options to a subcommand."""
    add = command.add_argument
    add('--domain-id', help='ROS domain, default: $ROS_DOMAIN_ID, else 0')
    add('--namespace', default='/', help='of the driver, such as /auv1')
    add('--odom', metavar='TOPIC', help='its odometry, default: odom')
    add('--wrench', metavar='TOPIC', help='what it takes, default: wrench')
    add('--odom-frame', help='frame of poses, default: odom_ned')
    add('--base-frame', help='body frame, default: base_link_fsd')
    add('--seconds', metavar='S', help='how long to listen, default: 10')
    add('--expect-rate', metavar='HZ', help='that the driver promises')
    text = 'stamps are those of /clock: the driver is a simulation'
    add('--use-sim-time', action='store_true', help=text)
    text = 'file or shipped bare name; for --actuate: bounds the wrench, predicts the answer'
    add('--vehicle', help=text)
    group = command.add_argument_group('wrenches, none of which is sent without --actuate')
    add = group.add_argument
    text = 'send small wrenches, an axis at a time: THE VEHICLE MOVES'
    add('--actuate', action='store_true', help=text)
    text = 'only this one; may be repeated; default: all that the vehicle can'
    add('--axis', action='append', choices=DOFS, help=text)
    text = 'largest speed by the model, m/s and rad/s, default: 0.1'
    add('--speed', metavar='V', help=text)
    add('--force', metavar='N', help='never more than this')
    add('--torque', metavar='NM', help='never more than this, N m')
