"""What to drive so that a model can be identified: excitations of most information, predicted."""
