"""Options of `auv tune`."""

import argparse

LAWS = ('gvc', 'cl', 'pid', 'smc')


def add_options(command: argparse.ArgumentParser) -> None:
    """Add what is particular to `auv tune` to its parser."""
    text = 'controller to equal; default: the first under gvc'
    command.add_argument('--reference', metavar='NAME', help=text)
    text = "only this one beside the reference's own; may be repeated; default: all shipped"
    command.add_argument('--law', action='append', choices=LAWS, help=text)
    text = 'what the laws are given alike; default: effort'
    command.add_argument('--equal', choices=('effort', 'error'), default='effort', help=text)
    text = 'of the error: weighted by time, or the plain mean; default: time'
    command.add_argument('--index', choices=('time', 'mean'), default='time', help=text)
    structures = ('best', 'scalar', 'mass', 'diagonal', 'inertia')
    text = 'of gains: times I, M_ii, six numbers, times M; default: the better of the first two'
    command.add_argument('--structure', choices=structures, default='best', help=text)
    text = 'relative, of the equality; default: 0.001'
    command.add_argument('--tolerance', type=float, default=0.001, help=text)
    text = 'draws of the Monte Carlo; 0: none; default: 256'
    command.add_argument('--samples', type=int, metavar='N', default=256, help=text)
    text = 'how far draws go, such as damping=0.3 or current=0.1; may be repeated'
    command.add_argument('--spread', action='append', metavar='NAME=VALUE', help=text)
    text = 'of search and draws; default: 0'
    command.add_argument('--seed', type=int, default=0, help=text)
