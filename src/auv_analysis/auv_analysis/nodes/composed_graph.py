"""The five nodes in one process and one thread: what `auv run --composed` starts.

They are the same nodes with the same names, parameters and topics; only the processes between them
are gone. The process ends with the first node that ends, in a run with the recorder.
"""

from auv_analysis.nodes.analysis_node import AnalysisNode
from auv_analysis.nodes.recorder_node import RecorderNode
from auv_dynamics.nodes.plant_node import PlantNode
from auv_dynamics.ros.node_main import main_of
from auv_gvc_controller.nodes.controller_node import ControllerNode
from auv_gvc_controller.nodes.setpoint_node import SetpointNode


def main() -> None:
    """Run the nodes; the recorder is closed last and hears what the others have to say."""
    main_of(RecorderNode, PlantNode, SetpointNode, ControllerNode, AnalysisNode)
