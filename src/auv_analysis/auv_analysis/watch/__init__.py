"""A live look at a node graph, without ROS: what was heard, what it says, how it is shown."""
