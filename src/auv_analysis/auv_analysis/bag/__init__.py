"""Reading recorded bags, finished or not: what lies in them, runs, and long runs in blocks."""

from auv_analysis.bag.load import Recording, load_run, open_bag
from auv_analysis.bag.metadata import bag_files
from auv_analysis.bag.reading import BagContents, batches, read_bag

__all__ = ['BagContents', 'Recording', 'bag_files', 'batches', 'load_run', 'open_bag', 'read_bag']
