"""The options of `auv linearize`."""

import argparse


def add_options(command: argparse.ArgumentParser) -> None:
    """What is linearised, and about which point."""
    text = 'of a vehicle or a scenario: a file, or the bare name of a shipped one'
    command.add_argument('subject', metavar='VEHICLE_OR_SCENARIO', help=text)
    text = "only this one of a scenario's; may be repeated"
    command.add_argument('--controller', action='append', help=text)
    six = ('U', 'V', 'W', 'P', 'Q', 'R')
    text = 'velocity about which, m/s and rad/s; default: at rest'
    command.add_argument('--nu0', nargs=6, type=float, metavar=six, help=text)
    text, three = 'attitude about which, rad; default: level', ('PHI', 'THETA', 'PSI')
    command.add_argument('--attitude', nargs=3, type=float, metavar=three, help=text)
