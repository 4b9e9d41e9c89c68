"""What the water really does: uncertainty, current, actuators, sensors, faults, the plant."""
