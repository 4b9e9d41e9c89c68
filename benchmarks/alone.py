"""Rollouts of one vehicle after the other, in a process of their own: prints s per rollout.

Where compiled code comes to lie differs from process to process, and in a few of a hundred it runs
a third slower for as long as they last. So every round of the measurement takes a new one.
"""

import statistics

from bench_rollouts import DURATION
from loops import case1, single
from measure import RUNS, seconds

SINGLES = 20  # that are timed together


def main() -> None:
    """Measure as often as there are rounds elsewhere, and print the median."""
    one = single(case1(DURATION))
    one()

    def singles() -> None:
        for _ in range(SINGLES):
            one()

    print(statistics.median(seconds(singles) for _ in range(RUNS)) / SINGLES)


if __name__ == '__main__':
    main()
