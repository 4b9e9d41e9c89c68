"""The gains of a controller as factors: each multiplied by a number of its own."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from auv_analysis.changes import changed_scenario
from auv_analysis.scenario import Scenario


@dataclass(frozen=True)
class GainFactors:
    """What of a controller is multiplied.

    Attributes
    ----------
    scenario : the same with every default gain of the controller written out
    controller : its name
    values : gain -> what the scenario gives: one number, (6,) or (6, 6)
    left_out : gain -> why it is no factor

    """

    scenario: Scenario
    controller: str
    values: Mapping[str, np.ndarray]
    left_out: Mapping[str, str]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the gains that are multiplied."""
        return tuple(self.values)

    def changes(self, factors: np.ndarray) -> dict[str, np.ndarray]:
        """Changes for `rollouts`.

        Parameters
        ----------
        factors : (B, k) positive, a column per gain

        Returns
        -------
        changes : path -> (B, ...) gains

        """
        return {
            gain_path(self.controller, name): np.multiply.outer(factors[:, i], value)
            for i, (name, value) in enumerate(self.values.items())
        }


def gain_path(controller: str, gain: str) -> str:
    """Path of a gain; a controller's name may have dots in it."""
    return f"controllers.'{controller}'.{gain}"


def gain_factors(scenario: Scenario, controller: str) -> GainFactors:
    """Every gain of a controller's law that is not zero, those left to their defaults as well.

    Raises
    ------
    InputError : no such controller

    """
    scenario.controller(controller)
    given: dict[str, Any] = scenario.gain_values(controller)
    law = type(scenario.gains(controller))
    defaults = getattr(law, '_field_defaults', {})
    missing = {name: _plain(value) for name, value in defaults.items() if name not in given}
    if missing:
        written = {gain_path(controller, name): value for name, value in missing.items()}
        scenario = changed_scenario(scenario, written)
    values = {name: np.asarray(value, float) for name, value in {**given, **missing}.items()}
    moved = {name: values[name] for name in law._fields if np.any(values[name] != 0.0)}
    still = {name: 'zero: a factor leaves it as it is' for name in values if name not in moved}
    return GainFactors(scenario, controller, moved, still)


def _plain(value: Any) -> Any:
    return np.asarray(value, float).tolist()
