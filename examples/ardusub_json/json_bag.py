"""A dive under ArduSub as bags that `auv analyze` reads."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.bag.metadata import Definition
from auv_analysis.bag.ros2msg import schema_text
from auv_analysis.bag.step_topics import KINDS
from auv_analysis.bag.writer import BagWriter
from auv_dynamics.files.errors import FailedError, InputError, reason
from auv_dynamics.ros import interface

PERIOD = 10_000_000  # ns between two samples
ROLES = (interface.ODOM, interface.WRENCH, interface.WRENCH_APPLIED, interface.DISTURBANCE)


class Bags:
    """A bag for each start of the autopilot: FOLDER, FOLDER_2, ...

    Parameters
    ----------
    folder : of the first
    attachments : name -> text: vehicle file and scenario

    """

    def __init__(self, folder: Path, attachments: Mapping[str, str]):
        try:
            from auv_dynamics.ros import codec, topics
        except ImportError as error:
            raise FailedError(f'--bag needs ROS 2, whose messages it writes: {error}') from None
        types = {topic.name: topic.type for topic in topics.TOPICS}
        self._codecs = {r: codec.Codec(types[r], interface.Frames(), r) for r in ROLES}
        self._folder, self._attachments, self._count = folder, attachments, 1
        self._writer = self._opened(folder)

    def begin(self) -> None:
        """Begin the next bag, unless the present one is empty."""
        if self._writer.count:
            self._writer.close()
            self._count += 1
            self._writer = self._opened(
                self._folder.with_name(f'{self._folder.name}_{self._count}')
            )

    def _opened(self, folder: Path) -> BagWriter:
        self._due = 0
        try:
            writer = BagWriter(folder, self._attachments)
        except OSError as error:
            raise InputError('--bag', f'{folder}', 'a new folder', reason(error)) from None
        for role in ROLES:
            writer.add_channel(Definition(f'/{role}', KINDS[role]), schema_text(KINDS[role]))
        return writer

    def write(self, t: float, x: np.ndarray, *wrenches: Any) -> None:
        """State (13,) at t s, wrench of the pulses, wrench applied and F, when they are due."""
        ns = round(t * interface.NANOSECONDS)
        if ns >= self._due:
            self._due = (ns // PERIOD + 1) * PERIOD
            for role, values in zip(ROLES, (x, *wrenches), strict=True):
                self._writer.write(f'/{role}', ns, self._codecs[role].encode(ns, values))

    def close(self) -> None:
        """Finish the last bag."""
        self._writer.close()
