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
    signal.signal(signal.SIGTERM, signal.getsignal(signal.SIGINT))  # it ends what it has started
    busy = [subprocess.Popen([sys.executable, '-c', BUSY]) for _ in range(int(count))]
    print(f'busy beside it: {[process.pid for process in busy]}, on {os.cpu_count()} cores')
    try:
        return subprocess.run(command, check=False).returncode
    finally:
        for process in busy:
            process.kill()
            process.wait()


if __name__ == '__main__':
    sys.exit(main(*sys.argv[1:]))
