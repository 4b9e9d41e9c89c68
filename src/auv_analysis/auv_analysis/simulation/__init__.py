"""The closed loop in this process: one run, or batches of rollouts in lanes."""
