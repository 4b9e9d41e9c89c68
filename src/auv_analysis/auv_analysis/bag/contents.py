"""What lies in a bag: attachments, topics and, of our topics, stamps and numbers."""

from dataclasses import dataclass, field

import numpy as np

from auv_dynamics.files.errors import InputError
from auv_dynamics.ros.interface import Frames

Series = tuple[np.ndarray, np.ndarray]  # stamps (n,) in ns, values (n, 6) or (n, 13)


class NotOursError(InputError):
    """A bag whose topics are not those that our nodes publish."""


@dataclass
class Contents:
    """What lies in a bag, before anything is made of it.

    Attributes
    ----------
    attachments : name -> text
    metadata : name -> mapping
    types : topic -> message type
    counts : topic -> number of messages
    first, last : ns, None when the bag is empty
    messages : topic -> stamps (n,) in ns and values (n, 6) or (n, 13), of our topics
    notes : what is odd, one line each
    frames : namespace -> frames of its first odometry
    names : recorded topic -> our name of it, where the recorder's topics were remapped
    namespace : that is read: the one asked for, else that of the recorder; None: any
    asked : whether it was asked for
    lenient : whether a driver was free to say anything: what cannot be used is left out

    """

    attachments: dict[str, str] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    types: dict[str, str] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    first: int | None = None
    last: int | None = None
    messages: dict[str, Series] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    frames: dict[str, Frames] = field(default_factory=dict)
    names: dict[str, str] = field(default_factory=dict)
    namespace: str | None = None
    asked: bool = False
    lenient: bool = False

    def span(self, first: int, last: int) -> None:
        """Note that there are messages logged from `first` to `last`, ns."""
        self.first = first if self.first is None else min(self.first, first)
        self.last = last if self.last is None else max(self.last, last)
