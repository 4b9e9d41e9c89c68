"""Two machines on one wire, as network namespaces: what leaves one, what the other reaches."""

import shutil
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from helpers.needs import need

INSIDE, OUTSIDE = '10.9.8.7', '10.9.8.6'
TOOLS = ('unshare', 'nsenter', 'ip')


class Machine:
    """A network of its own, with shared memory of its own, as long as its process lives."""

    def __init__(self) -> None:
        # shared memory would be a way around the wire
        script = 'mount -t tmpfs none /dev/shm && echo made && exec sleep 600'
        command = ['unshare', '--net', '--mount', 'sh', '-c', script]
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        self.made = self.process.stdout.readline() == 'made\n'

    def command(self, *words: str) -> list[str]:
        """Command that runs there."""
        return ['nsenter', '-t', str(self.process.pid), '--net', '--mount', *words]

    def run(self, *words: str) -> str:
        """Output of a command that runs there."""
        return subprocess.run(
            self.command(*words), check=True, capture_output=True, text=True
        ).stdout

    def sent(self) -> int:
        """Packets that have left on the wire."""
        lines = self.run('cat', '/proc/net/dev').splitlines()
        return int(next(line for line in lines if 'wire' in line).split()[10])

    def close(self) -> None:
        """Give it up."""
        self.process.kill()
        self.process.communicate()


@contextmanager
def two_machines() -> Iterator[tuple[Machine, Machine]]:
    """Two machines on one wire; the test is skipped where they cannot be had."""
    need('namespaces', all(map(shutil.which, TOOLS)))
    with ExitStack() as stack:
        machines = [Machine(), Machine()]
        for machine in machines:
            stack.callback(machine.close)
        need('namespaces', all(machine.made for machine in machines))
        peer = str(machines[1].process.pid)
        machines[0].run('ip', 'link', 'add', 'wire', 'type', 'veth', 'peer', 'name', 'wire',
                        'netns', peer)  # fmt: skip
        for machine, address in zip(machines, (INSIDE, OUTSIDE), strict=True):
            machine.run('ip', 'link', 'set', 'lo', 'up')
            machine.run('sh', '-c', 'echo 1 > /proc/sys/net/ipv6/conf/wire/disable_ipv6')
            machine.run('ip', 'address', 'add', f'{address}/24', 'dev', 'wire')
            machine.run('ip', 'link', 'set', 'wire', 'up', 'multicast', 'on')
            machine.run('ip', 'route', 'add', 'default', 'dev', 'wire')
        yield machines[0], machines[1]
