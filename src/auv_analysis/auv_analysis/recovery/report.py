"""What a repair did and what is in the bag now, as a document."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from auv_analysis.bag.roles import role_of
from auv_analysis.recovery.audit import Audit
from auv_analysis.recovery.spacing import Spacing
from auv_dynamics.ros.interface import NANOSECONDS, OPTIONAL_STEP_TOPICS, STEP_TOPICS


@dataclass
class FileReport:
    """What became of a file: 'healthy', 'repaired' or 'left out'."""

    audit: Audit
    name: str
    state: str
    kept_as: str | None = None

    def document(self) -> dict[str, Any]:
        """As `--json` prints it."""
        return {
            'file': self.name,
            'state': self.state,
            'kept_as': self.kept_as,
            'faults': self.audit.faults,
            'lost': [
                {'from': lost.start, 'to': lost.end, 'why': lost.why} for lost in self.audit.lost
            ],
            'messages': self.audit.count,
            'messages_lost': self.audit.messages_lost,
        }


@dataclass
class Report:
    """What became of a bag.

    Attributes
    ----------
    bag : as it was named
    files : in their order
    metadata : 'unchanged', 'written' or 'none': a bag that rosbag2 has nothing to say of
    notes : what could not be done, one line each

    """

    bag: str
    files: list[FileReport] = field(default_factory=list)
    metadata: str = 'unchanged'
    notes: list[str] = field(default_factory=list)

    @property
    def changed(self) -> bool:
        """Whether anything was written."""
        return self.metadata == 'written' or any(file.state != 'healthy' for file in self.files)

    def document(self) -> dict[str, Any]:
        """As `--json` prints it."""
        topics = _topics(file.audit for file in self.files)
        spans = [s for _, s in topics.values() if s.earliest is not None]
        first = min((s.earliest for s in spans if s.earliest is not None), default=None)
        last = max((s.latest for s in spans if s.latest is not None), default=None)
        lost = [file.audit.messages_lost for file in self.files]
        return {
            'bag': self.bag,
            'changed': self.changed,
            'files': [file.document() for file in self.files],
            'metadata': self.metadata,
            'duration': None if first is None or last is None else (last - first) / NANOSECONDS,
            'messages': sum(file.audit.count for file in self.files),
            'messages_lost': None if None in lost else sum(n for n in lost if n is not None),
            'topics': {
                topic: {'type': kind, 'messages': spacing.count, **_gaps(topic, spacing)}
                for topic, (kind, spacing) in sorted(topics.items())
            },
            'attachments': sorted(
                {name for file in self.files for name, _ in file.audit.attachments}
            ),
            'notes': self.notes,
        }


def _topics(audits: Iterable[Audit]) -> Mapping[str, tuple[str, Spacing]]:
    """Topic -> type and stamps, over all files."""
    found: dict[str, tuple[str, Spacing]] = {}
    for audit in audits:
        for channel in audit.definitions.channels():
            schema = audit.definitions.schema_of(channel)
            kind = schema.name if schema else ''
            _, spacing = found.setdefault(channel.topic, (kind, Spacing()))
            spacing.join(audit.spacings.get(channel.id, Spacing()))
    return found


def _gaps(topic: str, spacing: Spacing) -> dict[str, Any]:
    """Gaps of a step topic; other topics come when they come."""
    is_step = role_of(topic) in (*STEP_TOPICS, *OPTIONAL_STEP_TOPICS)
    return {'spacing': spacing.gaps() if is_step else None}
