"""Linear models of the vehicle and of its closed loop, for the tools of control engineers."""
