"""Bags of other systems: any topics that hold odometry and wrench, read as a `Run`."""
