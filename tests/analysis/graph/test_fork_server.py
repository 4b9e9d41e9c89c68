"""What `auv run` forks is like what was executed: arguments, output, exit code, end."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = """#!{python}
import json, os, sys, time
from pathlib import Path

def main():
    me = Path('/proc/self')
    facts = {{
        'how': HOW, 'argv': sys.argv, 'mine': os.environ.get('MINE'),
        'stray': 'STRAY' in os.environ,
        'parent': os.getppid(), 'session': os.getsid(0) == os.getpid(), 'input': sys.stdin.read(),
        'listed': (me / 'cmdline').read_text().replace('\\0', ' ').split(),
        'name': (me / 'comm').read_text().strip(), 'files': len([*(me / 'fd').iterdir()]),
    }}
    print(json.dumps(facts), flush=True)
    if 'wait' in sys.argv:
        time.sleep(60)
    os._exit(7)

HOW = 'executed' if __name__ == '__main__' else 'forked'
if __name__ == '__main__':
    main()
"""
ASKER = """
import json, os, sys, time
from pathlib import Path
from auv_analysis.graph.fork_server import ForkServer

os.environ['STRAY'] = ''

def start(server, *arguments):
    log = Path('log').open('w+b')
    env = {**os.environ, 'MINE': 'yes'}
    del env['STRAY']
    process = server.begin(
        [str(Path('a_program').resolve()), *arguments], env=env, stdin=-3, stdout=log, stderr=log
    )
    while not Path('log').read_text().endswith('\\n'):
        time.sleep(0.01)
    return process, json.loads(Path('log').read_text())

found = {'me': os.getpid()}
with ForkServer({'a_program': 'a_module'}) as server:
    ended, found['forked'] = start(server, 'a', 'b c')
    found['code'] = ended.wait()
    waiting, _ = start(server, 'wait')
    assert waiting.poll() is None
    waiting.kill()
    found['killed'] = waiting.wait(), waiting.poll()
    outliving, _ = start(server, 'wait')
    os.kill(server._pid, 9)
    again, found['again'] = start(server, 'a')
    found['left'] = outliving.poll()
    outliving.kill()
print(json.dumps(found))
"""


@pytest.fixture(scope='module')
def found(tmp_path_factory) -> dict:
    folder = tmp_path_factory.mktemp('forks')
    for name in ('a_module.py', 'a_program'):
        (folder / name).write_text(PROGRAM.format(python=sys.executable))
    (folder / 'a_program').chmod(0o755)
    (folder / 'asks.py').write_text(ASKER)
    ended = subprocess.run(
        [sys.executable, 'asks.py'], cwd=folder, capture_output=True, text=True, check=False
    )
    assert (ended.returncode, ended.stderr) == (0, '')
    return {'folder': folder, **json.loads(ended.stdout)}


def test_it_is_like_one_that_was_executed(found: dict) -> None:
    forked, executed = found['forked'], found['again']
    program = str(found['folder'] / 'a_program')
    assert (forked['how'], executed['how']) == ('forked', 'executed'), 'as the server was killed'
    assert forked['argv'] == [program, 'a', 'b c']
    assert forked['listed'][1:] == [program, 'a', 'b', 'c']
    assert Path(forked['listed'][0]).samefile(sys.executable)
    assert forked['session'], 'Ctrl-C is not for it'
    for key in ('mine', 'stray', 'parent', 'input', 'name', 'files'):
        assert forked[key] == executed[key], key
    assert forked['parent'] == found['me']


def test_its_end_is_told(found: dict) -> None:
    assert found['code'] == 7
    assert found['killed'] == [-9, -9]
    assert found['left'] is None, 'it outlives the one that has forked it'
