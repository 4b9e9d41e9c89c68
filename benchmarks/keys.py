"""What `make bench` measures: every key with what it must reach and what it aims at."""

from dataclasses import dataclass

import numpy as np
from measure import Measured

FLAT = 0.1  # memory that grows by less over ten times the length does not grow
NOT_JUDGED = 'not judged'
NOISE = 0.02  # an aim that is missed by less is not told from one that is reached


@dataclass(frozen=True)
class Key:
    """A row of the table.

    Attributes
    ----------
    what, reference : subject and what it is measured against
    kind : 'cost' is a time over the reference's, 'gain' a speed over the reference's,
        'memory' the value itself, whose aim is not to grow: the ratio is to a short bag's
    must, aim : bounds of that number, from above for a cost or a value, from below for a gain;
        None: it is there for information
    why : why the aim is missed, where it is

    """

    name: str
    what: str
    reference: str
    kind: str
    must: float | None = None
    aim: float | None = None
    why: str = ''

    def number(self, measured: Measured) -> float:
        """What is compared with `must` and `aim`."""
        if self.kind == 'memory' or measured.ratio is None:
            return measured.value
        return measured.ratio

    def verdict(self, measured: Measured) -> str:
        """'aim reached', 'met', 'MISSED', 'not judged: load x', or '' where nothing is asked."""
        if self.must is None or self.aim is None:
            return ''
        if measured.load and not measured.load.quiet:
            return f'{NOT_JUDGED}: load {measured.load.others:.1f}'
        number = self.number(measured)
        if not self._within(number, self.must, 0.0):
            return 'MISSED'
        if self.kind == 'memory':
            number, noise = measured.ratio or np.inf, FLAT
        else:
            noise = NOISE
        return 'aim reached' if self._within(number, self.aim, noise) else 'met'

    def bound(self, value: float | None) -> str:
        """A bound as the table shows it."""
        if value is None:
            return ''
        if self.kind == 'memory' and value == self.aim:
            return 'flat'
        return f'{"≥" if self.kind == "gain" else "≤"} {value:g}'

    def _within(self, number: float, bound: float, noise: float) -> bool:
        if self.kind == 'gain':
            return number >= bound * (1 - noise)
        return number <= bound * (1 + noise)


CASE1 = 'Case 1, 10 s'
KEYS = (
    Key(
        'rollout_vs_c', f'{CASE1}: one of a batch of 96 with figures, one thread',
        'scalar C', 'cost', 0.6, 0.25,
        'reached where the speed of the machine is steady: this ratio scatters most where other '
        'machines share the host.',
    ),
    Key(
        'single_vs_c', f'{CASE1}: one rollout with figures', 'scalar C', 'cost', 1.2, 0.85,
        'a single vehicle leaves the vector registers empty. numba could put neighbouring numbers '
        'into them (`NUMBA_SLP_VECTORIZE=1` takes a seventh off), but then a single run would '
        'round otherwise than the same vehicle in a batch; now they agree to the last bit here.',
    ),
    Key(
        'native_c_vs_c', 'the C reference built for this processor (`-march=native`)',
        'scalar C', 'cost',
    ),
    Key(
        'openloop_vs_c', 'the plant alone, 10 s of commands: one of 96 variants, every state',
        'scalar C', 'cost', 0.6, 0.25,
        'an eighth of the time is packing the variants and writing every state. Fewer passes '
        "of the integrator's sums through memory were tried and gained nothing.",
    ),
    Key(
        'threads_2_vs_1', 'a batch of 2 048 on two threads', 'one thread', 'gain', 1.6, 1.95,
        'packing the vehicles into lanes and unpacking their figures, 1 % of the work, is done by '
        'one thread; the rest is what else runs on two cores.',
    ),
    Key(
        'growth_batch', 'one of a batch of 10 000, parameters included',
        'one of a batch of 100', 'cost', 1.2, 1.0,
    ),
    Key('growth_horizon', 'a batch over 100 s', 'over 10 s', 'cost', 11.0, 10.0),
    Key(
        'rollout_vs_solve_ivp', f'{CASE1}: rollouts of a batch, one thread',
        'scipy `solve_ivp`', 'gain', 100.0, 300.0,
    ),
    Key(
        'rollout_vs_python_control', f'{CASE1}: rollouts of a batch, one thread',
        'python-control', 'gain', 20.0, 100.0,
    ),
    Key(
        'sweep_10k_vs_c', '`auv sweep`: 10 000 rollouts of Case 1 over 10 s, to Parquet',
        '10 000 of scalar C on two cores', 'cost', 0.5, 0.4,
        'half of it is the start of the command: importing numba and pyarrow, reading the compiled '
        'kernel, checking the campaign. That does not grow with the rollouts.',
    ),
    Key(
        'graph_vs_pingpong', 'five processes, every topic recorded: steps',
        'round trips of bare rclpy', 'gain', 0.45, 0.9,
        'five processes share two cores, which the two of the ping-pong have to themselves; the '
        'cost is that of messages times their readers. `--composed` saves most of it.',
    ),
    Key(
        'composed_vs_pingpong', 'all nodes in one process, every topic recorded: steps',
        'round trips of bare rclpy', 'gain', 0.5, 1.7,
        'one thread takes, publishes and records every message by itself, which is half of its '
        'time; the ping-pong is spread over two cores.',
    ),
    Key(
        'composed_plain_vs_pingpong', "the same, rclpy's `SingleThreadedExecutor` serves it all",
        'round trips of bare rclpy', 'gain',
    ),
    Key(
        'composed_events_vs_pingpong', "the same, rclpy's `EventsExecutor` serves it all",
        'round trips of bare rclpy', 'gain',
    ),
    Key(
        'bag_read_vs_raw_reader', 'messages of a bag to arrays',
        '`mcap` raw reader', 'gain', 15.0, 30.0,
        'nearly half of the time is decompression and the checksum of each chunk, which the raw '
        'reader does not verify. Doing it ahead in a thread was tried and gained nothing.',
    ),
    Key('bag_read_vs_rosbags', 'the same', 'rosbags, decoding', 'gain'),
    Key('bag_read_vs_mcap_ros2_support', 'the same', 'mcap-ros2-support, decoding', 'gain'),
    Key(
        'analysis_vs_numpy', 'figures of 1e6 samples',
        'the same in NumPy, whole arrays', 'gain', 8.0, 30.0,
        'memory: to add up the same five arrays, and nothing else, takes NumPy three quarters of '
        'this time.',
    ),
    Key(
        'analysis_one_hour_rss_mb', 'memory to analyse a bag of one hour',
        'one of six minutes', 'memory', 250.0, 1.0,
        'the report takes most of it: matplotlib, Bokeh, pyarrow and scipy are loaded for it. What '
        'the hour adds to six minutes is not found.',
    ),
    Key(
        'info_one_hour_rss_mb', 'memory of `auv info` on a bag of one hour',
        'one of six minutes', 'memory', 120.0, 1.0,
    ),
    Key(
        'case1_again_s', '`auv run case1`, both laws on five nodes each, with report', '',
        'cost', 15.0, 10.0,
        'the steps of each law take some seconds, the nodes of each have to find each other, '
        'and most of what the report takes are its figures.',
    ),
    Key(
        'study_s', '`auv study case1`', '', 'cost', 10.0, 8.0,
        'nearly all of it is the drawing of its figures, three quarters of that their layout and '
        'the subsets of fonts in each PDF.',
    ),
    Key(
        'simulate_s', '`auv simulate case1 --no-report`', '', 'cost', 1.5, 1.0,
        'imports, mostly numba and pyarrow, and the compiled kernel that is loaded.',
    ),
    Key(
        'node_ready_cpu_s', 'CPU time until a controller node tracks', '', 'cost', 1.5, 1.0,
        'imports: numba is the largest part, then rclpy and its messages.',
    ),
    Key('help_vs_python', '`auv --help`', '`python -c pass`', 'cost', 4.0, 2.0),
)  # fmt: skip
BY_NAME = {key.name: key for key in KEYS}

# measured together: module:function, which gives a Measured by key
GROUPS = {
    'bench_rollouts:against_c': ('rollout_vs_c', 'single_vs_c', 'native_c_vs_c'),
    'bench_rollouts:open_loop_against_c': ('openloop_vs_c',),
    'bench_rollouts:threads': ('threads_2_vs_1',),
    'bench_rollouts:growth': ('growth_batch', 'growth_horizon'),
    'bench_rollouts:against_scipy': ('rollout_vs_solve_ivp',),
    'bench_rollouts:against_python_control': ('rollout_vs_python_control',),
    'bench_commands:sweep': ('sweep_10k_vs_c',),
    'bench_nodes:against_pingpong': (
        'graph_vs_pingpong',
        'composed_vs_pingpong',
        'composed_plain_vs_pingpong',
        'composed_events_vs_pingpong',
    ),
    'bench_bags:against_readers': (
        'bag_read_vs_raw_reader',
        'bag_read_vs_rosbags',
        'bag_read_vs_mcap_ros2_support',
    ),
    'bench_analysis:against_numpy': ('analysis_vs_numpy',),
    'bench_analysis:one_hour': ('analysis_one_hour_rss_mb', 'info_one_hour_rss_mb'),
    'bench_commands:again': ('case1_again_s', 'study_s', 'simulate_s'),
    'bench_commands:node_ready': ('node_ready_cpu_s',),
    'bench_commands:command_line': ('help_vs_python',),
}
