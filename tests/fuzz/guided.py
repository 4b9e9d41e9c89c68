"""Fuzzing that is guided by coverage: atheris looks for inputs that reach new lines.

python tests/fuzz/guided.py text|decoding|bags COUNT SEED
"""

import inspect
import os
import re
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import atheris

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import decoding
import files
from watchman import WAITING

READERS = ('files', 'vehicle_file', 'interface', 'ros.codec', 'scenario', 'scenario_values')
WHERE = re.compile(rf'auv_(dynamics|analysis)\.({"|".join(READERS)}|bag\..*)')


def instrument() -> None:
    """Let atheris see the lines of what reads; numba could not compile instrumented kernels."""
    for name, module in list(sys.modules.items()):
        if WHERE.fullmatch(name):
            for value in vars(module).values():
                for one in vars(value).values() if isinstance(value, type) else [value]:
                    if inspect.isfunction(one) and one.__module__ == name:
                        atheris.instrument_func(one)


TARGETS: dict[str, tuple[Callable[[bytes], object], Callable[[], list[bytes]], int]] = {
    'text': (files.try_text, files.texts, 6000),
    'decoding': (decoding.try_messages, decoding.messages, 4000),
    'bags': (files.try_bag, files.bags, 60_000),
}


def main(target: str, count: str, seed: str) -> None:
    """Try so many inputs; libFuzzer ends the process, with another code than 0 on a failure."""
    one, originals, longest = TARGETS[target]
    failures = Path(os.environ.get('AUV_GVC_FUZZ_FAILURES', 'fuzz-failures')).resolve()
    failures.mkdir(parents=True, exist_ok=True)
    corpus = Path(tempfile.mkdtemp(prefix='auv_gvc_corpus_'))
    for i, data in enumerate(originals()):
        (corpus / f'original_{i}').write_bytes(data)

    def test_one_input(data: bytes) -> None:
        one(bytes(data))

    options = [
        *(f'-runs={count}', f'-seed={int(seed) + 1}', f'-max_len={longest}'),
        f'-timeout={round(WAITING)}',  # on the wall; `watched` counts the work
        *('-rss_limit_mb=4096', f'-artifact_prefix={failures}/{target}-', '-verbosity=0'),
        '-print_final_stats=1',
    ]
    instrument()
    atheris.Setup([sys.argv[0], *options, str(corpus)], test_one_input)
    atheris.Fuzz()


if __name__ == '__main__':
    main(*sys.argv[1:])
