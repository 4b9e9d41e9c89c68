"""What a measurement was made on: the machine and the versions."""

import os
import platform
import subprocess
from importlib import metadata
from pathlib import Path

import psutil

PACKAGES = (
    'numpy', 'numba', 'llvmlite', 'scipy', 'control', 'mcap', 'mcap-ros2-support', 'rosbags',
    'ros-jazzy-rclpy', 'pyarrow', 'dask', 'distributed',
)  # fmt: skip


def machine() -> dict[str, object]:
    """Processor, cores that may be used, memory in GB, kernel, and the load at the start.

    Each key has the load that others made beside it: see `load.Load`.
    """
    return {
        'cpu': _cpu(),
        'cores': len(os.sched_getaffinity(0)),
        'memory_gb': round(psutil.virtual_memory().total / 1e9, 1),
        'kernel': f'{platform.system()} {platform.release()} {platform.machine()}',
        'load': round(os.getloadavg()[0], 2),
    }


def versions() -> dict[str, str]:
    """Python, the packages that take part and are installed, and the measured commit."""
    found = {'python': platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    commit = _output('git', 'describe', '--always', '--dirty')
    return {**found, **({'commit': commit} if commit else {})}


def _cpu() -> str:
    lines = Path('/proc/cpuinfo').read_text().splitlines()
    names = [line.partition(':')[2].strip() for line in lines if line.startswith('model name')]
    return names[0] if names else platform.processor()


def _output(*command: str) -> str:
    folder = Path(__file__).parent
    try:
        result = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    except OSError:
        return ''
    return result.stdout.strip()
