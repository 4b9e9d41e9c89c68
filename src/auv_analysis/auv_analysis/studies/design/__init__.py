"""Vehicle design: the change of a hull that removes a coupling, predicted and simulated."""
