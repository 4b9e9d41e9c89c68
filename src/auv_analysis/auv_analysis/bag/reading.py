"""A bag from its first file to its last: batch by batch, or all of it."""

from collections.abc import Iterator
from pathlib import Path

from auv_analysis.bag.contents import Contents, Series
from auv_analysis.bag.files import bag_files
from auv_analysis.bag.messages import Batch, FileReader
from auv_analysis.bag.records import records
from auv_analysis.bag.steps import joined_series

TOGETHER = 64  # chunks whose small arrays are joined at once: thousands of them scatter the memory


def batches(bag: str | Path, contents: Contents, *, decode: bool = True) -> Iterator[Batch]:
    """Messages of our topics in the order of the bag, a chunk at a time.

    Parameters
    ----------
    bag : folder or .mcap file
    contents : filled on the way, but for its messages
    decode : whether our topics are read; else nothing comes, but everything is counted

    Raises
    ------
    InputError : not a bag, or a message that must not be used

    """
    for path in bag_files(bag):
        reader = FileReader(path, contents, decode)
        for item in records(path, contents.notes):
            yield from reader.take(item)
        reader.finish()


def read_bag(bag: str | Path, namespace: str | None = None, *, decode: bool = True) -> Contents:
    """Read a bag.

    Parameters
    ----------
    bag : folder or .mcap file
    namespace : whose topics are ours; None: what the bag says, else any
    decode : read the messages of our topics; else only count

    Raises
    ------
    InputError : not a bag, or a message that must not be used

    """
    contents = Contents(namespace=namespace, asked=namespace is not None)
    found: dict[str, list[Series]] = {}
    small: dict[str, list[Series]] = {}
    for topic, stamps, rows in batches(bag, contents, decode=decode):
        parts = small.setdefault(topic, [])
        parts.append((stamps, rows))
        if len(parts) == TOGETHER:
            found.setdefault(topic, []).append(joined_series(parts))
            parts.clear()
    for topic, parts in small.items():  # one topic after the other, so that little is held twice
        contents.messages[topic] = joined_series([*found.pop(topic, []), *parts])
    return contents
