"""ROS nodes of the plant: parameters in, core object built, messages converted."""
