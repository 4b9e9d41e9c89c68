"""Live view of a node graph, without ROS: messages heard, state, problems, screen."""
