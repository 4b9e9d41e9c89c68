"""The vehicle: its file, M, C(nu), D(nu), g(eta), kinematics, frames and thrusters."""

DOFS = ('surge', 'sway', 'heave', 'roll', 'pitch', 'yaw')
