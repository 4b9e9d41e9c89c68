"""Writing of bags that survive a kill, a full disk and a folder that is taken away."""

from auv_analysis.recording.guard import RecordingError
from auv_analysis.recording.storage import COMPRESSIONS, Storage
from auv_analysis.recording.writer import BagWriter

__all__ = ['COMPRESSIONS', 'BagWriter', 'RecordingError', 'Storage']
