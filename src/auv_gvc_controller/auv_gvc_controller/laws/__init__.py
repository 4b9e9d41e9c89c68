"""Control laws: GVC, CL, PID, sliding mode; what a law is given and how it is found by name."""

NAMES = ('gvc', 'cl', 'pid', 'smc')  # the module of each, whose class is its name in capitals
