"""Coverage, with branches: `make coverage`. All of the mathematics, nine tenths of the rest.

What numba compiles is not seen line by line. The files that `tests/mutation/mutation.toml` names,
and those below, are therefore measured in plain Python, by the tests that are named there and
take short cases; everything else by the whole fast suite, in all the processes that it starts.
"""

import argparse
import os
import subprocess
import sys
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
MUTATED = tomllib.loads((HERE.parent / 'mutation/mutation.toml').read_text(encoding='utf-8'))
KINDS = 'formulas', 'loops', 'figures'
MORE = {  # mathematics whose mutants are not tried, and its tests
    'auv_dynamics/auv_dynamics/plant/devices.py': ['analysis/test_simulate_faults.py'],
    'auv_dynamics/auv_dynamics/plant/faults.py': ['dynamics/test_fault_rows.py'],
    'auv_dynamics/auv_dynamics/kernel/lanes.py': ['dynamics/test_lanes.py'],
    'auv_gvc_controller/auv_gvc_controller/control/controller.py': ['controller/test_hand_over.py'],
    'auv_gvc_controller/auv_gvc_controller/control/setpoint.py': ['controller/test_setpoint.py'],
}
CONFIG = """
[run]
branch = true
parallel = true
source_pkgs = auv_dynamics, auv_gvc_controller, auv_analysis
data_file = {data}
patch = subprocess, _exit

[report]
{chosen}
precision = 1
skip_covered = true
show_missing = true
fail_under = {least}
# what only compiled code runs is seen by the whole suite, not line by line
exclude_also =
    if JITTED:
    if is_compiled\\(gains\\):
"""


def mathematics() -> tuple[list[str], list[str]]:
    """Its files below src, and tests below tests that see every line of them."""
    listed = {**MORE, **{file: tests for kind in KINDS for file, tests in MUTATED[kind].items()}}
    tests = {test for named in (*listed.values(), *MUTATED['quick'].values()) for test in named}
    return sorted(listed), sorted(tests)


def measured(
    name: str, least: float, chosen: str, tests: Sequence[str], environ: Mapping[str, str]
) -> int:
    """Run tests under coverage and print what they miss; 1 where it is too much."""
    folder = ROOT / 'build' / 'coverage' / name
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob('data*'):
        old.unlink()
    config = folder / 'coverage.ini'
    config.write_text(CONFIG.format(data=folder / 'data', least=least, chosen=chosen))
    around = {**os.environ, **environ, 'COVERAGE_RCFILE': str(config)}
    coverage = [sys.executable, '-m', 'coverage']

    def run(*command: str) -> int:
        return subprocess.run(command, cwd=ROOT, env=around, check=False).returncode

    run(*coverage, 'run', '-m', 'pytest', '-q', '-p', 'no:cacheprovider', *tests)
    run(*coverage, 'combine', '-q')
    print(f'{name}: at least {least:g} %', flush=True)
    return run(*coverage, 'report')


def main() -> int:
    """Measure both; 0 where both suffice."""
    parser = argparse.ArgumentParser(description='Coverage with branches.')
    parser.add_argument('--only', choices=['mathematics', 'rest'])
    only = parser.parse_args().only
    files, tests = mathematics()
    paths = [f'*/{file}' for file in files]
    codes = []
    if only != 'rest':
        chosen = 'include = ' + ', '.join(paths)
        named = [str(Path('tests') / test) for test in tests]
        plain = {'NUMBA_DISABLE_JIT': '1', 'AUV_GVC_EXAMPLES': '25'}
        codes.append(measured('mathematics', 100.0, chosen, ['-n', '2', *named], plain))
    if only != 'mathematics':
        chosen = 'omit = ' + ', '.join(paths)
        codes.append(measured('rest', 90.0, chosen, ['-n', '4', '--dist', 'loadfile'], {}))
    return max(codes)


if __name__ == '__main__':
    sys.exit(main())
