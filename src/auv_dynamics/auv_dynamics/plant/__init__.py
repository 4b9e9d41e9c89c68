"""The plant: uncertainty, current, actuators, sensors and faults."""
