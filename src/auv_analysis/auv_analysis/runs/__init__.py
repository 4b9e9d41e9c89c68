"""A run, simulated or recorded: its samples, what is known of it, its windows."""
