"""What a check of the set-up found, how bad that is, and what to do."""

from collections.abc import Callable, Iterable, Iterator
from typing import Literal, NamedTuple

from auv_dynamics.files.errors import named_line

Verdict = Literal['ok', 'note', 'warning', 'broken']


class Finding(NamedTuple):
    """One thing that was looked at.

    Attributes
    ----------
    check : a word for what was looked at
    verdict : 'broken' where commands will fail, 'warning' where they may, 'note' where something
        is absent that few need
    found : what is there
    advice : what to do; empty where all is well

    """

    check: str
    verdict: Verdict
    found: str
    advice: str = ''

    def line(self) -> str:
        """For people: verdict, check, what was found, what to do."""
        advice = f'\n{"":10}-> {self.advice}' if self.advice else ''
        return f'{self.verdict:<8}  {self.check}: {self.found}{advice}'


Check = Callable[[], Iterable[Finding]]


def findings_of(checks: Iterable[Check]) -> Iterator[Finding]:
    """Findings of checks, one after the other; a check that fails is a finding itself."""
    for check in checks:
        try:
            yield from check()
        except Exception as error:  # whatever a broken set-up does: the other checks go on
            name = getattr(check, '__name__', 'check').replace('_', ' ')
            found = f'could not be looked at: {named_line(error)}'
            yield Finding(name, 'broken', found, 'make clean, then make setup')
