"""Laws tuned to equal effort or equal error, then compared over the same random changes."""
