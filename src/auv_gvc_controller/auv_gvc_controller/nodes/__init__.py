"""ROS nodes of the controller: the velocity controller and the set-points."""
