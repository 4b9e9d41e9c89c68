"""Snapshot of a live graph as plain numbers: the screen shows it, --json prints it.

Six numbers stand in the order of the degrees of freedom; what is not known is None.
"""

from dataclasses import asdict, dataclass, field
from typing import Any

Six = tuple[float, ...]
LEVELS = ('ok', 'warning', 'error', 'stale')  # of diagnostic_msgs/DiagnosticStatus


@dataclass(frozen=True)
class TopicState:
    """Reception of a topic's messages.

    Attributes
    ----------
    name : as the nodes call it
    publishers, subscribers : how many, this program not counted
    rate : messages per second of the wall
    age : s since the last one was taken, steady clock
    heard, published : messages since the first one that was heard
    gaps, repeats : stamps that are missing, or not later than the one before; None: not judged
    refused : messages that must not be used

    """

    name: str
    publishers: int = 0
    subscribers: int = 0
    rate: float | None = None
    age: float | None = None
    heard: int = 0
    published: int = 0
    gaps: int | None = None
    repeats: int | None = None
    refused: int = 0


@dataclass(frozen=True)
class NodeState:
    """Health of a node by `/diagnostics`: level, text, s since then, its facts."""

    name: str
    level: str
    text: str
    age: float
    facts: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Alert:
    """Something that is wrong: `level` is 'error' or 'warning', `age` s since it was last seen."""

    level: str
    text: str
    count: int = 1
    age: float = 0.0


@dataclass(frozen=True)
class Errors:
    """Velocity errors nu_d - nu in m/s, rad/s: now, and of the last `window` s as heard."""

    now: Six | None = None
    largest: Six | None = None
    rms: Six | None = None
    window: float = 0.0
    history: tuple[Six, ...] = ()


@dataclass(frozen=True)
class Energy:
    """Kinetic energy (30) in J, by component in J and in %."""

    total: float
    by_component: Six
    shares_percent: Six


@dataclass(frozen=True)
class Snapshot:
    """A graph at one moment.

    Attributes
    ----------
    domain, namespace : where was listened
    vehicle : name of the vehicle file that was given, or None
    seconds : how long was listened
    motion : topic that the true velocity is taken from
    time, pace : stamp of the newest odometry in s; s of stamps per s of the wall
    recorded : stamp of the last step that the recorder has complete, s
    nu, nu_d, tau, lumped_error : m/s and rad/s; N and N m, body frame
    velocity_error : nu_d - nu
    kinetic_energy, delta_xi, delta_pi : (30), (33), (34)
    computed : whether these were computed here, as the graph does not publish them
    structural_zeros : degrees of freedom whose couplings vanish for this vehicle
    topics, nodes, alerts : health; alerts are `troubles` in the document

    """

    domain: int
    namespace: str = '/'
    vehicle: str | None = None
    seconds: float = 0.0
    motion: str | None = None
    time: float | None = None
    pace: float | None = None
    recorded: float | None = None
    nu: Six | None = None
    nu_d: Six | None = None
    tau: Six | None = None
    velocity_error: Errors = Errors()
    lumped_error: Six | None = None
    kinetic_energy: Energy | None = None
    delta_xi: Six | None = None
    delta_pi: Six | None = None
    computed: bool = False
    structural_zeros: dict[str, list[str]] | None = None
    topics: tuple[TopicState, ...] = ()
    nodes: tuple[NodeState, ...] = ()
    alerts: tuple[Alert, ...] = ()

    @property
    def heard(self) -> bool:
        """Whether any message has come on a topic of this namespace, refused ones included."""
        return any(topic.heard for topic in self._inside)

    @property
    def published(self) -> bool:
        """Whether somebody publishes a topic of this namespace."""
        return any(topic.publishers for topic in self._inside)

    @property
    def _inside(self) -> list[TopicState]:
        return [topic for topic in self.topics if not topic.name.startswith('/')]

    def document(self) -> dict[str, Any]:
        """The snapshot ready for JSON."""
        document = asdict(self)
        document['troubles'] = document.pop('alerts')
        return document
