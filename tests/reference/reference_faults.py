"""Which faults are there at a sample, and which of them lose something (docs/faults.md)."""

from __future__ import annotations

from typing import Any

import numpy as np

AXES = ('surge', 'sway', 'heave', 'roll', 'pitch', 'yaw')


class Faults:
    """What of a scenario's list fails at sample k."""

    def __init__(self, specs: list[dict[str, Any]], h: float, seed: int):
        self.specs, self.h = specs, h
        self.streams: dict[int, np.random.Generator] = {}
        for kind, name in enumerate(('sensor_drop_out', 'wrench_loss')):
            of_kind = [i for i, spec in enumerate(specs) if spec['kind'] == name]
            for nth, i in enumerate(of_kind):
                sequence = np.random.SeedSequence(seed, spawn_key=(2, kind, nth))
                self.streams[i] = np.random.Generator(np.random.PCG64(sequence))

    def now(self, kind: str, k: int) -> list[dict[str, Any]]:
        """Entries of a kind that are there at sample k; ask once per sample where they draw."""
        found = []
        for i, spec in enumerate(self.specs):
            if spec['kind'] != kind:
                continue
            uniform = self.streams[i].random() if i in self.streams else 0.0
            begun = k * self.h > spec.get('from', 0.0) - 1e-9
            over = 'to' in spec and k * self.h > spec['to'] - 1e-9
            if begun and not over and uniform < spec.get('probability', 1.0):
                found.append(spec)
        return found

    def there(self, kind: str, k: int) -> list[dict[str, Any]]:
        """The same without a draw."""
        return [
            spec
            for spec in self.specs
            if spec['kind'] == kind
            and k * self.h > spec.get('from', 0.0) - 1e-9
            and ('to' not in spec or k * self.h < spec['to'] - 1e-9)
        ]


def weakened(value: float, faults: list[dict[str, Any]]) -> float:
    """What faults of one device leave of its output."""
    for fault in faults:
        value = fault['stuck'] if 'stuck' in fault else fault['efficiency'] * value
    return value
