"""A command beside busy processes, which end with it.

python tests/helpers/busy.py COUNT COMMAND...
"""

import os
import signal
import subprocess
import sys

BUSY = 'import os\nparent = os.getppid()\nwhile os.getppid() == parent: sum(range(100_000))'


def main(count: str, *command: str) -> int:
    """Exit code of the command."""
    busy = [subprocess.Popen([sys.executable, '-c', BUSY]) for _ in range(int(count))]
    print(f'busy beside it: {[one.pid for one in busy]}, on {os.cpu_count()} cores', flush=True)
    try:
        process = subprocess.Popen(command)
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # of a terminal, which the command has as well
        signal.signal(signal.SIGTERM, lambda *_: process.send_signal(signal.SIGINT))
        return process.wait()
    finally:
        for one in busy:
            one.kill()
            one.wait()


if __name__ == '__main__':
    sys.exit(main(*sys.argv[1:]))
