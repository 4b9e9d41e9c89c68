"""The experiment's file: its grammar, values by dotted path, scaling to a vehicle, templates."""
