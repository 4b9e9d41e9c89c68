"""Whether a vehicle's driver keeps the contract of odometry and wrench."""
