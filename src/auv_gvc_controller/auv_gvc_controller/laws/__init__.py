"""Control laws: GVC, CL, PID, sliding mode, open loop; what a law is given, and laws by name."""

NAMES = ('gvc', 'cl', 'pid', 'smc')  # the module of each, whose class is its name in capitals
OPEN_LOOP = 'multisine'  # the same of the law that tracks nothing
