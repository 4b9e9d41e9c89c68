"""Who else is in the graph: who would act on replayed commands, who publishes the same."""

from typing import Any

from auv_analysis.node_parameters import ANALYSIS, RECORDER
from auv_dynamics.ros.endpoints import UNNAMED, observes

ONLOOKERS = (ANALYSIS, RECORDER)  # our nodes that act on nothing
NAMELESS = 'a node without a name yet'
NAMED = 1.0  # s after which a name does not come any more


def actors(node: Any, topic: str) -> list[str]:
    """Subscribers of a topic that may act on it, full names.

    Parameters
    ----------
    node : that looks
    topic : full name

    """
    found = node.get_subscriptions_info_by_topic(topic)
    return sorted({_name(one) for one in found if not _only_looks(one)})


def rivals(node: Any, topic: str) -> list[str]:
    """Publishers of a topic beside one of the node's own, full names.

    Parameters
    ----------
    node : that looks
    topic : full name

    """
    names = [_name(one) for one in node.get_publishers_info_by_topic(topic)]
    if (own := node.get_fully_qualified_name()) in names:
        names.remove(own)  # once: a second one of this name is another node
    return sorted(names)


def _only_looks(endpoint: Any) -> bool:
    return endpoint.node_name in ONLOOKERS or (endpoint.node_name != UNNAMED and observes(endpoint))


def _name(endpoint: Any) -> str:
    if endpoint.node_name == UNNAMED:
        return NAMELESS  # the names of nodes arrive behind their endpoints
    return f'{endpoint.node_namespace.rstrip("/")}/{endpoint.node_name}'
