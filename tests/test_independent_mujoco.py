"""The rigid body against MuJoCo's: free and pushed tumbling, for ten seconds.

MuJoCo's free joint has the position of the body's origin and its velocity in world axes, a quaternion (w, x, y, z) and the
body rates about the body's own axes; its `RK4` is the classical one.
"""

from typing import NamedTuple

import numpy as np
import pytest

from quadstep.engines.loop import runge_kutta_4
from quadstep.numbers import Matrix, vector
from quadstep.numbers.rotations import rotation_matrix
from quadstep.vehicle.rigid_body import MassProperties, Motion, motion_rate, renormalised
from tests.flights import array, column
from tests.needs import package

mujoco = package("mujoco")

SECONDS, STEP, EVERY = 10.0, 0.002, 50
MASS = 1.3
NOTHING = vector(0.0, 0.0, 0.0)
UNEQUAL = np.diag([0.020, 0.030, 0.041])
FULL = np.array([[0.020, 0.001, -0.002], [0.001, 0.041, 0.003], [-0.002, 0.003, 0.030]])
ATTITUDE, VELOCITY = (0.8, 0.0, 0.36, 0.48), (1.0, -2.0, 5.0)


class Case(NamedTuple):
    """A body of `MASS`. offset: of its centre of gravity from its origin [m]. force [N] and torque about the origin [N m]:
    held, in body axes.
    """

    inertia: np.ndarray
    rates: tuple[float, float, float]
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gravity: float = 0.0
    force: tuple[float, float, float] = (0.0, 0.0, 0.0)
    torque: tuple[float, float, float] = (0.0, 0.0, 0.0)


CASES = {
    "tumbling": Case(UNEQUAL, (3.0, -4.0, 2.0)),
    "about the intermediate axis": Case(UNEQUAL, (0.02, 8.0, 0.04)),
    "off its origin, falling": Case(FULL, (2.0, 3.0, -1.0), (0.05, -0.03, 0.08), 9.81),
    "off its origin, pushed": Case(FULL, (0.2, 0.5, -0.1), (0.005, -0.003, 0.08), 9.81, (0.1, -0.2, 9.0), (0.01, -0.02, 0.03)),
}


def theirs(case):
    """A row after each `EVERY` steps: position, velocity, attitude, body rates."""
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = case.inertia.tolist()
    text = f"""
    <mujoco>
      <option gravity="0 0 {-case.gravity}" integrator="RK4" timestep="{STEP}"/>
      <worldbody>
        <body>
          <freejoint/>
          <inertial pos="{words(case.offset)}" mass="{MASS}" fullinertia="{xx} {yy} {zz} {xy} {xz} {yz}"/>
          <site name="origin"/>
        </body>
      </worldbody>
      <actuator><motor site="origin" gear="{words(case.force + case.torque)}"/></actuator>
    </mujoco>"""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.ctrl[:] = 1.0
    data.qpos[3:] = ATTITUDE
    data.qvel[:] = [*VELOCITY, *case.rates]
    rows = []
    for _ in range(round(SECONDS / STEP / EVERY)):
        mujoco.mj_step(model, data, EVERY)
        rows.append([*data.qpos[:3], *data.qvel[:3], *data.qpos[3:], *data.qvel[3:]])
    return np.array(rows)


def words(numbers):
    return " ".join(str(number) for number in numbers)


def ours(case):
    """The same."""
    properties = MassProperties(MASS, column(case.offset), Matrix(column(row) for row in case.inertia))
    force, torque = column(case.force), column(case.torque)
    motion, rows = Motion(NOTHING, column(VELOCITY), column(ATTITUDE), column(case.rates)), []

    def rate(now):
        return motion_rate(properties, rotation_matrix(now.attitude), now, force, torque, NOTHING, case.gravity)

    for tick in range(1, round(SECONDS / STEP) + 1):
        motion = renormalised(runge_kutta_4(rate, motion, STEP))
        if tick % EVERY == 0:
            rows.append(np.concatenate([array(part) for part in motion]))
    return np.array(rows)


def apart(one, other):
    """Largest difference in any column, whichever of the two quaternions stands for an attitude."""
    sign = np.sign((one[:, 6:10] * other[:, 6:10]).sum(axis=1))[:, None]
    other = np.concatenate([other[:, :6], sign * other[:, 6:10], other[:, 10:]], axis=1)
    return np.abs(one - other).max()


@pytest.mark.parametrize("case", CASES)
def test_a_body_tumbles_as_mujocos(case):
    mine, other = ours(CASES[case]), theirs(CASES[case])
    assert np.ptp(mine[:, 6:10], axis=0).min() > 0.5  # it really tumbles
    if case == "about the intermediate axis":
        assert np.count_nonzero(np.diff(np.sign(mine[:, 11]))) >= 2  # over, and back
    assert apart(mine, other) < 1e-7
