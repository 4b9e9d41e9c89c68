"""The words for the six degrees of freedom; without NumPy, for whatever must start quickly."""

DOFS = ('surge', 'sway', 'heave', 'roll', 'pitch', 'yaw')
