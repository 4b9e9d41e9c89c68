"""Fuzzing of everything that comes from outside: `make fuzz`, see README.md beside this file."""

import argparse
import gc
import itertools
import json
import os
import random
import re
import socket
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
SHARES = {  # of the inputs
    'vehicles': 0.20, 'imports': 0.06, 'scenarios': 0.16, 'parameters': 0.04, 'text': 0.08,
    'messages': 0.23, 'decoding': 0.13, 'bags': 0.078, 'guided_bags': 0.02, 'costs': 0.002,
}  # fmt: skip
FEW = 1000  # inputs, of which none waits for long
GUIDED = {'text': 'text', 'decoding': 'decoding', 'guided_bags': 'bags'}


def structured(attempt: Callable[[Any], str], originals: list[Any], count: int, seed: int) -> Any:
    """Let Hypothesis alter good files; how often each verdict was given."""
    import hypothesis
    from structures import altered

    verdicts: Counter[str] = Counter()

    @hypothesis.seed(seed)
    @hypothesis.settings(
        max_examples=count, deadline=None, database=None, print_blob=False,
        suppress_health_check=list(hypothesis.HealthCheck),
    )  # fmt: skip
    @hypothesis.given(altered(originals))
    def every(data: Any) -> None:
        verdicts[attempt(data)] += 1

    every()
    return verdicts


def vehicles(count: int, seed: int) -> Any:
    """Vehicle files."""
    from files import dumped, originals, try_vehicle

    return structured(lambda x: try_vehicle(dumped(x)), originals('vehicles'), count, seed)


def scenarios(count: int, seed: int) -> Any:
    """Scenario files."""
    from files import dumped, originals, try_scenario

    return structured(lambda x: try_scenario(dumped(x)), originals('scenarios'), count, seed)


def parameters(count: int, seed: int) -> Any:
    """Parameter files of the nodes."""
    from helpers.node_processes import environment, fresh_domain
    from start_up import originals, try_parameters

    from auv_analysis.graph.domain import ports

    domain = fresh_domain()
    os.environ.update(environment(domain))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as kept:
        kept.bind(('127.0.0.1', ports(domain)[-1]))  # so it is free for no other target
        return structured(try_parameters, originals(), count, seed)


def messages(count: int, seed: int) -> Any:
    """Serialized messages on real nodes."""
    from nodes import NODES, fuzz_node

    told: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        for name in NODES:
            for key, number in fuzz_node(name, count // len(NODES), seed, Path(folder)).items():
                told[f'{name} {key}'] += number
    return told


def imports(count: int, seed: int) -> Any:
    """Vehicles of other systems with letters and numbers changed."""
    from files import IMPORTED, try_import
    from scramble import renumbered, scrambled

    rng, verdicts = random.Random(seed), Counter[str]()
    for _ in range(count):
        suffix, text = rng.choice([*IMPORTED.items()])
        data = renumbered(text, rng).encode()
        if rng.random() < 0.5:
            data = scrambled(data, rng, [other.encode() for other in IMPORTED.values()])
        told = rng.random() < 0.8
        try:
            verdicts[f'{suffix} {try_import(data, suffix, told=told)}'] += 1
        except Exception as error:
            error.add_note(f'{suffix}, told {told}: {data!r}')
            raise
    return verdicts


def bags(count: int, seed: int) -> Any:
    """Bags with bytes changed."""
    import files
    from scramble import scrambled

    rng, good, verdicts = random.Random(seed), files.bags(), Counter[str]()
    for i in range(count):
        data = scrambled(rng.choice(good), rng, good)
        try:
            verdicts[files.try_bag(data)] += 1
        except Exception:
            folder = Path(os.environ.get('AUV_GVC_FUZZ_FAILURES', 'fuzz-failures'))
            folder.mkdir(parents=True, exist_ok=True)
            (folder / f'bag-{seed}-{i}.mcap').write_bytes(data)
            raise
    return verdicts


def costs(count: int, seed: int) -> Any:
    """Small bags that declare very many records."""
    from files import try_costly_bag
    from helpers.costly_bags import drawn

    verdicts: Counter[str] = Counter()
    for name, data in itertools.islice(drawn(random.Random(seed)), count):
        try:
            verdicts[f'{name} {try_costly_bag(data)}'] += 1
        except Exception as error:
            error.add_note(f'{name}: {len(data)} bytes')
            raise
    return verdicts


def guided(target: str, count: int, seed: int) -> Any:
    """Let atheris look for inputs; it ends its process itself."""
    command = [sys.executable, str(HERE / 'guided.py'), GUIDED[target], str(count), str(seed)]
    with tempfile.TemporaryDirectory() as folder:  # libFuzzer ends without clearing up
        environ = {**os.environ, 'TMPDIR': folder}
        ended = subprocess.run(command, env=environ, capture_output=True, text=True, check=False)
    if ended.returncode:
        raise AssertionError(f'{ended.stdout[-3000:]}\n{ended.stderr[-3000:]}')
    tried = re.search(r'number_of_executed_units: (\d+)', ended.stdout + ended.stderr)
    if tried is None:
        raise AssertionError(f'atheris does not say what it tried: {ended.stderr[-2000:]}')
    return {'tried': int(tried[1])}


OWN: dict[str, Callable[[int, int], Any]] = {
    'vehicles': vehicles, 'imports': imports, 'scenarios': scenarios, 'parameters': parameters,
    'messages': messages, 'bags': bags, 'costs': costs,
}  # fmt: skip


def one(target: str, count: int, seed: int) -> int:
    """Try one target in this process; 1 where something failed, which is printed."""
    began = time.monotonic()
    try:
        told = guided(target, count, seed) if target in GUIDED else OWN[target](count, seed)
    except BaseException as error:
        for line in (f'{type(error).__name__}: {error}', *getattr(error, '__notes__', [])):
            print(line, file=sys.stderr)
        again = f'python tests/fuzz/run.py --only {target} --count {count} --seed {seed}'
        print(f'FAILED: {target}; again: {again}', file=sys.stderr)
        return 1
    line = {'inputs': count, 'seconds': round(time.monotonic() - began), **told}
    print(f'{target}, seed {seed}: {json.dumps(line)}', flush=True)
    return 0


def together(targets: Sequence[str], count: int, seed: int, jobs: int) -> int:
    """Try targets in processes of their own, which share the inputs and what was imported."""
    import start_up  # noqa: F401
    import structures  # noqa: F401
    from compile_kernels import LAWS, compile_law

    from auv_analysis import load_scenario
    from auv_analysis.simulation.simulate import warm_up

    warm_up(load_scenario('case1'), ['gvc'])  # with what most of them load
    gc.freeze()  # none of them looks through it for garbage
    for law in LAWS if count > FEW else ():  # no input waits for the compiler
        compile_law(law)

    inputs = sum(SHARES[target] for target in targets)
    waiting, running, failed = [*targets], dict[int, str](), 0
    while waiting or running:
        if waiting and len(running) < jobs:
            target = waiting.pop(0)
            if pid := os.fork():
                running[pid] = target
                continue
            os._exit(one(target, max(1, round(count * SHARES[target] / inputs)), seed))
        pid, status = os.wait()
        target = running.pop(pid)
        if code := os.waitstatus_to_exitcode(status):
            print(f'{target} ended with exit code {code}', file=sys.stderr)
            failed += 1
    print(f'{count} inputs, seed {seed}: {failed or "none"} of {len(targets)} targets failed')
    return int(failed > 0)


def main() -> None:
    """Try everything, or one target."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--count', type=int, default=100_000, help='inputs')
    parser.add_argument('--seed', type=int, default=0)
    parser.add_argument('--jobs', type=int, default=2, help='targets at a time')
    parser.add_argument('--only', choices=SHARES, help='one target, with all the inputs')
    parser.add_argument('--unguided', action='store_true', help='leave out what atheris guides')
    options = parser.parse_args()
    if options.only:
        sys.exit(one(options.only, options.count, options.seed))
    targets = [target for target in SHARES if not (options.unguided and target in GUIDED)]
    sys.exit(together(targets, options.count, options.seed, options.jobs))


if __name__ == '__main__':
    main()
