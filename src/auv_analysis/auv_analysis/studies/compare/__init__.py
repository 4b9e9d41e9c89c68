"""Any number of runs side by side: where they come from, what they are called, how they compare."""
