"""The `auv` command: one module a command, and what commands share."""
