"""A rigid body without water against an engine that others keep: MuJoCo.

MuJoCo resolves the linear velocity of a free body in the world and the angular one in the body;
its world has no preferred axes, so that z may point down as ours does.
"""

from dataclasses import replace

import mujoco
import numpy as np
from helpers.physics import drive, vehicle_of
from helpers.strategies import QUICK, attitudes, vectors, vehicles
from hypothesis import given
from numpy.testing import assert_allclose

from auv_dynamics.plant.plant import initial_state
from auv_dynamics.vehicle.kinematics import quaternion, rotation

GRAVITY = 9.81
XML = """
<mujoco>
  <option gravity="0 0 {gravity}" timestep="{step}" integrator="RK4"/>
  <worldbody>
    <body name="vehicle">
      <freejoint/>
      <inertial mass="{mass!r}" pos="{place}" fullinertia="{inertia}"/>
    </body>
  </worldbody>
</mujoco>
"""


def numbers(values) -> str:
    return ' '.join(repr(float(value)) for value in values)


class Engine:
    """MuJoCo's model of the rigid body of a vehicle file, at a state of ours."""

    def __init__(self, data: dict, x: np.ndarray, step: float = 0.001):
        rigid, I = data['rigid_body'], np.array(data['rigid_body']['inertia'])
        text = XML.format(
            gravity=GRAVITY,
            step=step,
            mass=rigid['mass'],
            place=numbers(rigid['center_of_gravity']),
            inertia=numbers([I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]]),
        )
        self.model = mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(self.model)
        self.R = rotation(x[3:7])
        self.data.qpos[:] = x[:7]
        self.data.qvel[:] = [*(self.R @ x[7:10]), *x[10:]]

    def apply(self, tau: np.ndarray) -> None:
        """Wrench (6,) in the body frame."""
        self.data.qfrc_applied[:] = [*(self.R @ tau[:3]), *tau[3:]]

    def lift(self, buoyancy: float, r_B: np.ndarray) -> None:
        """Add a force of `buoyancy` N that points up at r_B."""
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        point = self.data.qpos[:3] + self.R @ r_B
        up = np.array([0.0, 0.0, -buoyancy])
        mujoco.mj_applyFT(self.model, self.data, up, np.zeros(3), point, 1, self.data.qfrc_applied)

    def acceleration(self) -> np.ndarray:
        """nu_dot (6,) in the body frame."""
        mujoco.mj_forward(self.model, self.data)
        omega, a = self.data.qvel[3:], self.data.qacc
        v = self.R.T @ self.data.qvel[:3]
        return np.concatenate([self.R.T @ a[:3] - np.cross(omega, v), a[3:]])

    def mass_matrix(self) -> np.ndarray:
        """M (6, 6) in the body frame."""
        mujoco.mj_forward(self.model, self.data)
        M = np.zeros((6, 6))
        for column, unit in zip(M, np.eye(6), strict=True):  # symmetric: rows are columns
            mujoco.mj_mulM(self.model, self.data, column, unit)
        turn = np.block([[self.R, np.zeros((3, 3))], [np.zeros((3, 3)), np.eye(3)]])
        return turn.T @ M @ turn


def without_water(data: dict) -> dict:
    return data | {
        'added_mass': [0.0] * 6,
        'lift': [[0.0] * 6] * 6,
        'damping': {'linear': [0.0] * 6, 'quadratic': [0.0] * 6},
        'environment': {'water_density': 1025.0, 'gravity': GRAVITY},
    }


def dry(data: dict):
    return replace(vehicle_of(without_water(data)), buoyancy=0.0)


@QUICK
@given(vehicles(), attitudes(1.5), vectors())
def test_rigid_body_matrix(data, eta, nu):
    theirs = Engine(data, initial_state(eta, nu)).mass_matrix()
    ours = vehicle_of(data).M_RB
    assert_allclose(ours, theirs, rtol=0, atol=1e-12 * np.abs(theirs).max())


@QUICK
@given(vehicles(), attitudes(1.5), vectors(), vectors(largest=100.0))
def test_forward_dynamics_of_a_rigid_body(data, eta, nu, tau):
    engine = Engine(data, initial_state(eta, nu))
    engine.apply(tau)
    theirs = engine.acceleration()
    ours = dry(data).forward_dynamics(eta, nu, tau)
    assert_allclose(ours, theirs, rtol=0, atol=1e-10 * (1 + np.abs(theirs).max()))


@QUICK
@given(vehicles(), attitudes(1.5), vectors(), vectors(largest=100.0))
def test_forward_dynamics_with_buoyancy(data, eta, nu, tau):
    vehicle = vehicle_of(without_water(data))
    engine = Engine(data, initial_state(eta, nu))
    engine.apply(tau)
    engine.lift(vehicle.buoyancy, vehicle.r_B)
    theirs = engine.acceleration()
    ours = vehicle.forward_dynamics(eta, nu, tau)
    assert_allclose(ours, theirs, rtol=0, atol=1e-10 * (1 + np.abs(theirs).max()))


@QUICK
@given(attitudes(1.5))
def test_attitude(eta):
    theirs, q = np.zeros(9), quaternion(eta[3:])
    mujoco.mju_quat2Mat(theirs, q)
    assert_allclose(rotation(q), theirs.reshape(3, 3), rtol=0, atol=1e-15)
    mujoco.mju_euler2Quat(q_theirs := np.zeros(4), eta[[5, 4, 3]], 'zyx')
    assert_allclose(q, q_theirs, rtol=0, atol=1e-15)


@QUICK
@given(vehicles(), attitudes(1.5), vectors(largest=1.0), vectors(3, 1.0))
def test_a_tumbling_fall(data, eta, nu, couple):
    x = initial_state(eta, nu)
    tau = np.concatenate([np.zeros(3), 0.1 * data['rigid_body']['mass'] * couple])
    engine = Engine(data, x, step=0.0025)
    engine.apply(tau)  # a couple alone: resolved in the body, it stays what it is while held
    mujoco.mj_step(engine.model, engine.data, nstep=200)
    ours = drive(dry(data), x, tau=tau, step=0.0025, steps=200)[-1]
    theirs, R = engine.data, rotation(ours[3:7])
    scale = 1.0 + np.abs(ours[7:]).max()
    assert_allclose(ours[:3], theirs.qpos[:3], rtol=0, atol=1e-9 * scale)
    assert_allclose(R, rotation(theirs.qpos[3:]), rtol=0, atol=1e-9 * scale)
    assert_allclose(R @ ours[7:10], theirs.qvel[:3], rtol=0, atol=1e-9 * scale)
    assert_allclose(ours[10:], theirs.qvel[3:], rtol=0, atol=1e-9 * scale)
