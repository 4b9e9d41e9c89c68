"""Options of `auv analyze` that tell what the topics of a foreign bag hold."""

import argparse


def add_options(group: argparse._ArgumentGroup) -> None:
    """Add them to a group of a parser."""
    group.add_argument('--map', metavar='FILE', help='mapping file; options replace its keys')
    group.add_argument('--odom', dest='odometry', metavar='TOPIC', help='nav_msgs/Odometry')
    group.add_argument('--wrench', metavar='TOPIC', help='the commanded WrenchStamped or Wrench')
    group.add_argument('--setpoint', metavar='TOPIC', help='TwistStamped, Twist or Odometry')
    group.add_argument('--frames', choices=('ned_fsd', 'enu_flu'), help='axes of all topics')
    text = 'axes in which the odometry writes the velocity, default: child'
    group.add_argument('--twist-frame', choices=('child', 'world'), help=text)
    text = 'common time base, default: the median period of the velocity'
    group.add_argument('--step', type=float, metavar='S', help=text)
    group.add_argument('--gap', type=float, metavar='S', help='longer pauses are gaps')
