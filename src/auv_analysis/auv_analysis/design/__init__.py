"""Which change of a vehicle removes which inertial coupling: proposed, then simulated."""
