"""Settings of the analysis node and the recorder."""

from dataclasses import dataclass

from auv_analysis.bag.output import COMPRESSIONS, FREE_SPACE, LARGEST_CHUNK
from auv_dynamics.ros.interface import STEP_TOPICS
from auv_dynamics.ros.settings import GridSettings, setting

ALL = 'all'  # other topics that are recorded


@dataclass(frozen=True)
class AnalysisSettings:
    """Settings of the analysis node."""

    vehicle: str = setting('', 'vehicle file, or shipped bare name', needed='a vehicle file')
    every: int = setting(10, 'steps between samples', at_least=1)
    ground_truth: bool = setting(False, 'look at ground_truth/odom in place of odom')


@dataclass(frozen=True)
class RecorderSettings(GridSettings):
    """Settings of the recorder node."""

    bag: str = setting('', 'folder of the bag', needed='the folder of the bag')
    topics: tuple[str, ...] = setting(STEP_TOPICS, 'step topics that are expected')
    extra_topics: tuple[str, ...] = setting(
        (), f'topics outside of the namespace that are recorded as well, or {ALL}'
    )
    exclude: str = setting(
        '', 'regular expression: topics in whose names it is found are not recorded, but for ours'
    )
    strict: bool = setting(True, 'a lost or doubled step ends the recording')
    analysis_every: int = setting(
        0, 'steps between analysis samples, 0: not waited for', at_least=0
    )
    compression: str = setting(
        'zstd', 'compression of chunks', 'storage.compression', one_of=[*COMPRESSIONS]
    )
    chunk_size: int = setting(
        1 << 20, 'bytes of a chunk', 'storage.chunk_size', at_least=1024, at_most=LARGEST_CHUNK
    )
    max_size: int = setting(0, 'most bytes of a file; 0: one file', 'storage.max_size', at_least=0)
    max_duration: float = setting(
        0.0, 'most log time in a file, s; 0: one file', 'storage.max_duration',
        at_least=0.0, at_most=1e9,
    )  # fmt: skip
    free_space: int = setting(
        FREE_SPACE, 'bytes that stay free on the file system: with less, the recording ends',
        'storage.free_space', at_least=0,
    )  # fmt: skip
    attachments: tuple[str, ...] = setting((), 'name=path of files kept in the bag')
