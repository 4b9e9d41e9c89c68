"""Herman 2018: its gains and numbers, its 21 claims as rows, and its two cases."""
