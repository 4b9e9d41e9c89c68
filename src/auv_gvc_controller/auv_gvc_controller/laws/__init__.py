"""Control laws: GVC, CL, PID, sliding mode; what a law is given and how it is found by name."""
