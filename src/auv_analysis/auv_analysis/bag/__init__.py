"""Reading recorded bags, finished or not: what lies in them, runs, and long runs in blocks."""

from typing import TYPE_CHECKING

from auv_dynamics.files.lazy import lazy_names

if TYPE_CHECKING:
    from auv_analysis.bag.load import Recording, load_run, open_bag
    from auv_analysis.bag.metadata import bag_files
    from auv_analysis.bag.reading import BagContents, batches, read_bag

_HOME = {
    **dict.fromkeys(('Recording', 'load_run', 'open_bag'), 'auv_analysis.bag.load'),
    **dict.fromkeys(('BagContents', 'batches', 'read_bag'), 'auv_analysis.bag.reading'),
    'bag_files': 'auv_analysis.bag.metadata',
}
__all__ = ['BagContents', 'Recording', 'bag_files', 'batches', 'load_run', 'open_bag', 'read_bag']
__getattr__, __dir__ = lazy_names(__name__, _HOME)
