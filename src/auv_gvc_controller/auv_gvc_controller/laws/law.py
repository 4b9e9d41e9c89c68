"""The control laws by name. A law is a named tuple of gains with two pure static functions."""

import importlib
import os
import sys
from collections.abc import Mapping
from typing import Any

import numpy as np

from auv_dynamics.files.errors import named_line
from auv_dynamics.files.nearest import meant, one_of
from auv_dynamics.files.yaml_files import matrix6
from auv_dynamics.kernel.compile import JITTED, load
from auv_gvc_controller.laws import NAMES, OPEN_LOOP

SHIPPED: dict[str, Any] = {
    name: getattr(importlib.import_module(f'{__package__}.{name}'), name.upper())
    for name in (*NAMES, OPEN_LOOP)
}
_asked: set[str] = set()  # own laws that somebody in this process has asked for by name


def law_class(name: str) -> Any:
    """Class of a law.

    Parameters
    ----------
    name : of a shipped law, or 'module:Class' of a user's own, found on Python's path or in the
        working directory

    Returns
    -------
    law : named tuple with `wrench`, `state_rate` and `STATES`

    Raises
    ------
    ValueError : no such law; the text says what was expected and found

    """
    if not isinstance(name, str):
        raise ValueError(f'expected {", ".join(SHIPPED)} or module:Class, found {name!r}')
    if name in SHIPPED:
        return SHIPPED[name]
    expected = f'{", ".join(SHIPPED)} or module:Class'
    module, _, attribute = name.partition(':')
    if not (module and attribute):
        raise ValueError(f'expected {expected}{meant(name, SHIPPED)}, found {name!r}')
    if os.getcwd() not in sys.path:
        sys.path.append(os.getcwd())  # a user's module may lie where `auv` was started
    try:
        found = importlib.import_module(module)
        law = getattr(found, attribute, None)
    except (Exception, SystemExit) as error:  # whatever a user's module does when it is imported
        raise ValueError(f'expected {expected}, found {name!r} ({named_line(error)})') from None
    if law is None:
        likely = meant(attribute, dir(found))
        raise ValueError(f'expected {expected}{likely}, found no {attribute} in {module}')
    if JITTED and 'numba' in sys.modules:
        load()  # what it compiles by itself may call the kernel's helpers
    missing = [
        part for part in ('wrench', 'state_rate', 'STATES', '_fields') if not hasattr(law, part)
    ]
    if not missing and not isinstance(law._fields, tuple):
        missing = ['a tuple of _fields']
    if missing:
        text = 'a named tuple of gains with wrench, state_rate and STATES'
        raise ValueError(f'expected {text}, found {name!r} without {", ".join(missing)}')
    _check_counts(law, name)
    _asked.add(name)
    return law


def is_unasked(name: object) -> bool:
    """Whether this names an own law that `law_class` has not been asked for in this process.

    What somebody else's bag or results name is not imported: to import a module is to run it.
    """
    return isinstance(name, str) and ':' in name and name not in _asked


def _check_counts(law: Any, name: str) -> None:
    states = law.STATES
    if not _whole(states) or states < 0:
        raise ValueError(f'expected {name} with STATES a whole number, found {states!r}')
    integrals = getattr(law, 'INTEGRALS', 0)
    if not _whole(integrals) or not 0 <= integrals <= states or integrals % 6:
        text = f'INTEGRALS a multiple of 6 up to STATES = {states}'
        raise ValueError(f'expected {name} with {text}, found {integrals!r}')


def _whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def try_law(gains: Any, model: Any) -> None:
    """Call the functions of a user's law once, at rest, and look at what they give.

    Parameters
    ----------
    gains : of `make_gains`
    model : ControlModel of the vehicle

    Raises
    ------
    ValueError : a function that fails or gives another number of values

    """
    law = type(gains)
    if law in SHIPPED.values():
        return
    zero, upright = (0.0,) * 6, (1.0, 0.0, 0.0, 0.0)
    arguments = (0.0, zero, upright, zero, zero, np.zeros(law.STATES), gains, model)

    def call(part: str, function: Any) -> Any:
        try:
            with np.errstate(all='ignore'):
                return function()
        except Exception as error:  # whatever a user's law does
            text = f'expected {part} of {law.__name__} to answer at rest, found {named_line(error)}'
            raise ValueError(text) from None

    answer = call('wrench', lambda: [np.asarray(a, float).shape for a in law.wrench(*arguments)])
    _expect(law, 'wrench', 'tau and f, 6 numbers each', answer, [(6,), (6,)])
    rates = call('state_rate', lambda: np.asarray(law.state_rate(*arguments), float).shape)
    _expect(law, 'state_rate', f'{law.STATES} numbers', rates, (law.STATES,))
    if hasattr(law, 'body_gains'):
        gained = call('body_gains', lambda: np.asarray(law.body_gains(gains, model), float))
        good = gained.size == 72 and bool(np.isfinite(gained).all())
        _expect(law, 'body_gains', 'two finite 6x6 matrices', good, True)
    if hasattr(law, 'own_rate'):
        rate = call('own_rate', lambda: float(law.own_rate(gains)))
        _expect(law, 'own_rate', 'a finite rate', bool(np.isfinite(rate)), True)


def _expect(law: Any, part: str, expected: str, found: Any, wanted: Any) -> None:
    if found != wanted:
        other = 'something else' if isinstance(found, bool) else found
        raise ValueError(f'expected {part} of {law.__name__} to give {expected}, found {other}')


def refusal(error: ValueError) -> tuple[str, str, str]:
    """Key, expected and found of an error of `law_class` or `make_gains`.

    The key is the name of a gain, or empty where the law itself is refused.
    """
    key, separator, rest = str(error).partition(': expected ')
    if not separator:
        key, rest = '', str(error).removeprefix('expected ')
    expected, _, found = rest.partition(', found ')
    return key, expected, found


def make_gains(name: str, values: Mapping[str, Any]) -> Any:
    """Gains of a law as the kernel takes them.

    Parameters
    ----------
    name : of the law
    values : for each gain 1 number (times identity), 6 (diagonal), 36 or 6x6; a gain for which the
        law's named tuple has a default may be absent

    Returns
    -------
    gains : the law's named tuple of (36,) arrays

    Raises
    ------
    ValueError : unknown law, missing or unknown gain, wrong shape, not finite

    """
    law = law_class(name)
    # unknown first: a misspelt gain also leaves a missing one
    unknown = [key for key in values if key not in law._fields]
    if unknown:
        expected = one_of(unknown[0], law._fields)
        raise ValueError(f'{unknown[0]}: expected {expected}, found an unknown gain')
    values = {**getattr(law, '_field_defaults', {}), **values}
    for key in law._fields:
        if key not in values:
            raise ValueError(f'{key}: expected a number, 6 numbers or a 6x6 matrix, found nothing')
    flat: dict[str, Any] = {}
    for key in law._fields:
        try:
            matrix = matrix6(values[key])
        except (ValueError, TypeError) as error:
            text = str(error) if 'expected ' in str(error) else f'expected numbers, found {error}'
            raise ValueError(f'{key}: {text}') from None
        if not np.all(np.isfinite(matrix)):
            raise ValueError(f'{key}: expected finite numbers, found {values[key]}')
        flat[key] = matrix.ravel()
    try:
        gains = law(**flat)
    except TypeError as error:
        text = 'a named tuple of gains'
        raise ValueError(f'expected {text}, found {name!r} ({named_line(error)})') from None
    if hasattr(law, 'check'):
        try:
            law.check(gains)
        except ValueError as error:
            if ': expected ' in str(error) and ', found ' in str(error):
                raise
            raise ValueError(f'expected gains that {name} accepts, found {error}') from None
        except Exception as error:  # whatever a user's law does
            text = f'expected check of {name} to judge the gains'
            raise ValueError(f'{text}, found {named_line(error)}') from None
    return gains
