"""ROS nodes of the analysis: analysis, recorder, replay, watch and driver check."""
