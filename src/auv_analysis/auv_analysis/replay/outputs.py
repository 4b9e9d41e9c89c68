"""Publishers of recorded topics: the types that are installed, the messages byte for byte."""

import re
from typing import Any

from auv_analysis.bag.ros2msg import definition
from auv_analysis.replay.index import PlayedTopic
from auv_analysis.replay.selection import Selection
from auv_dynamics.ros.endpoints import full_name
from auv_dynamics.ros.graph import Graph
from auv_dynamics.ros.kinds import message_class
from auv_dynamics.ros.offered import offered_again
from auv_dynamics.ros.topics import Topic

TYPE = re.compile(r'[a-z][a-z0-9_]*/msg/[A-Z][A-Za-z0-9]*', re.ASCII)


def make_publishers(
    graph: Graph, recorded: dict[str, PlayedTopic], selection: Selection
) -> dict[str, Any]:
    """Publishers by recorded name; what cannot be published moves to `selection.left_out`.

    Parameters
    ----------
    graph : of the node
    recorded : recorded name -> how it was recorded
    selection : of the topics

    """
    publishers = {}
    for topic, name in list(selection.names.items()):
        about = recorded[topic]
        kind = _installed(about.kind)
        why = f'its type {about.kind or "(none)"} is not installed'
        if kind is not None:
            qos = offered_again(about.qos, volatile=topic in selection.guarded)
            publisher = graph.publisher(Topic(name, kind), qos)
            if _means_the_same(graph.node, publisher, about.digest):
                publishers[topic] = publisher
                continue
            graph.node.destroy_publisher(publisher)
            why = f'its type {about.kind} is defined in another way here'
        del selection.names[topic]
        selection.guarded.discard(topic)
        selection.left_out[topic] = why
    return publishers


def _installed(name: str) -> type | None:
    """Class of a message type; what a bag names is imported only where it is a message package."""
    if not TYPE.fullmatch(name):
        return None
    try:
        definition(name)
        return message_class(name)
    except (FileNotFoundError, ImportError, AttributeError):
        return None


def _means_the_same(node: Any, publisher: Any, digest: str) -> bool:
    """Whether the installed type is the recorded one, as far as the bag says which it was."""
    for one in node.get_publishers_info_by_topic(publisher.topic_name):
        ours = full_name(one) == node.get_fully_qualified_name()
        if ours and digest.startswith('RIHS01_') and str(one.topic_type_hash) != digest:
            return False
    return True
