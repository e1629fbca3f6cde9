"""What the theorem of the lines of Q and d supposes of a closed loop, evaluated on the loop of the law that flies.

The equations and bounds are read as `proofs/lines.py` gives them to Coq; rates are central differences along the flow.
"""

import re

import numpy as np
import pytest

from proofs.lines import KNOWN, LEVEL_RATE, LOOP, NAMES
from quadstep.control.backstepping import position_loop
from quadstep.control.completed_backstepping import coupling_columns, with_yaw
from quadstep.interfaces.plant import Kinematics
from quadstep.numbers import Vector
from quadstep.proofs.theory import flow as flow_module
from quadstep.proofs.theory.edge import default_region
from quadstep.proofs.theory.flow import Flow, LoopInstant, draw
from quadstep.proofs.theory.region import R1
from quadstep.vehicle.paper import coriolis, effective_inertia, thrust_direction

UNKNOWN = 0.005
H = 1e-6
STANDARD = Kinematics.STANDARD
FUNCTIONS = {
    "add": (2, np.add), "scale": (2, np.multiply), "dot": (2, lambda a, b: (a * b).sum(axis=0)),
    "len": (1, lambda a: np.linalg.norm(a, axis=0)), "Rabs": (1, np.abs),
}  # fmt: skip
SLACK = 1e-5
"""Of the size of a line's parts: what differences over 2 H leave."""


class Captured(Flow):
    """Keeps what was drawn instead of finding slopes."""

    def slopes(self, errors, wanted, force, torque):
        self.drawn = self.at(errors, wanted), force, torque


class Line:
    """A line for Coq, evaluated: applications are prefix, sums and products infix."""

    def __init__(self, text, values):
        self.tokens, self.values = re.findall(r"<=|[\w]+|[()+*=/-]", text), values

    def sides(self):
        left = self.sum()
        if not self.tokens:
            return left, None, None
        relation = self.tokens.pop(0)
        return left, relation, self.sum()

    def sum(self):
        total = self.product()
        while self.tokens and self.tokens[0] in "+-":
            sign = 1.0 if self.tokens.pop(0) == "+" else -1.0
            total = total + sign * self.product()
        return total

    def product(self):
        value = self.application()
        while self.tokens and self.tokens[0] in "*/":
            times = self.tokens.pop(0) == "*"
            other = self.application()
            value = value * other if times else value / other
        return value

    def application(self):
        if self.tokens[0] == "-":
            self.tokens.pop(0)
            return -self.application()
        name = self.tokens[0]
        if name not in FUNCTIONS and name != "J":
            return self.atom()
        self.tokens.pop(0)
        if name == "J":
            return self.values["J"](self.atom())
        count, function = FUNCTIONS[name]
        return function(*(self.atom() for _ in range(count)))

    def atom(self):
        token = self.tokens.pop(0)
        if token != "(":
            return float(token) if token.isdecimal() else self.values[token]
        value = self.sum()
        assert self.tokens.pop(0) == ")"
        return value


def columns_of(vector, count):
    return np.array([np.broadcast_to(np.asarray(entry, dtype=float), count) for entry in vector])


@pytest.fixture(scope="module")
def values():
    """Every name of the statement, of some thousand closed loops inside the region: numbers (n,), vectors (3, n).

    The law runs with next to no sample time: its torque follows the filter's mean acceleration over a sample.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(flow_module, "STEP", 1e-10)
        return evaluated()


def evaluated():
    """The names with their values."""
    region = default_region(force=UNKNOWN, torque=UNKNOWN)
    flow = Captured(region, UNKNOWN, UNKNOWN)
    draw(flow, 5, 2000)
    now, force, torque = flow.drawn
    count = len(np.asarray(force[0]))
    s, shape, bounds = flow.setting, region.shape, region.bounds

    def outer(at: LoopInstant):
        return position_loop(flow.gains.paper, at.memory.paper, at.state, at.reference, 0.0)

    def matrices(at: LoopInstant):
        attitude, rates = at.state.attitude, at.state.rates
        j = effective_inertia(attitude, flow.vehicle.inertia, STANDARD)
        c = coriolis(attitude, rates, flow.vehicle.inertia, STANDARD)
        return [
            np.array([[np.broadcast_to(np.asarray(m[i, k], dtype=float), count) for k in range(3)] for i in range(3)])
            for m in (j, c)
        ]

    def desired_force(at: LoopInstant):
        found = outer(at)
        return columns_of(found.u_d * thrust_direction(with_yaw(0.0, found.tilt)), count)

    def known(at: LoopInstant):
        """What changes with time."""
        tilt, filtered = Vector(at.state.attitude.entries[1:]), at.memory.paper.filtered
        r1, i1, e1, e2, r2, i2, a, b, a_c, b_c = flow.errors(at)
        found = {"r1": r1, "I1": i1, "e1": e1, "e2": e2, "r2": r2, "I2": i2}
        found |= {name: with_yaw(0.0, one) for name, one in (("a", a), ("b", b), ("a_c", a_c), ("b_c", b_c))}
        found = {name: columns_of(one, count) for name, one in found.items()}
        counter = columns_of(with_yaw(0.0, at.memory.counter.value), count)
        raw = counter + found["a_c"] + found["b_c"]
        command = columns_of(with_yaw(0.0, outer(at).tilt), count)
        columns = [columns_of(one, count) for one in coupling_columns(tilt, filtered.value)]
        return found | {
            "c": counter, "c_raw": raw, "command": command, "F": desired_force(at), "thrust": np.asarray(outer(at).u_d),
            "columns": columns, "filtered": filtered.value,
        }  # fmt: skip

    here, later, before = known(now), *(known(flow.moved(now, h, force, torque)) for h in (H, -H))

    def rate(name):
        return (later[name] - before[name]) / (2.0 * H)

    def transposed(columns, vector):
        return np.array([np.zeros(count), *((one * vector).sum(axis=0) for one in columns)])

    j, c = matrices(now)
    r2_dot, r1_dot, e2_dot = rate("r2"), rate("r1"), rate("e2")
    along = [
        columns_of(thrust_direction(with_yaw(0.0, one)), count)
        for one in (here["filtered"], Vector(now.state.attitude.entries[1:]))
    ]
    turned = (np.array(later["columns"]) - np.array(before["columns"])) / (2.0 * H)
    settings = {NAMES.get(name, name): float(one) for name, one in s._asdict().items()}
    settings |= {NAMES[name]: float(one) for name, one in shape._asdict().items()}
    found = {name: here[name] for name in ("r1", "I1", "e1", "e2", "r2", "I2", "a", "b", "a_c", "b_c", "c", "c_raw", "thrust")}
    found |= {
        "r1_dot": r1_dot, "e2_dot": e2_dot, "F_dot": rate("F"), "command_dot": rate("command"), "c_raw_dot": rate("c_raw"),
        "thrust_dot": rate("thrust"), "eps1": -columns_of(force, count), "eps2": -columns_of(torque, count),
        "delta_f": here["F"] - here["thrust"] * along[0], "Be2": along[0] - along[1],
        "jerk": columns_of(now.reference.jerk, count), "J_r2_dot": np.einsum("ikn,kn->in", j, r2_dot),
        "C_r2": np.einsum("ikn,kn->in", c, here["r2"]), "C_I2": np.einsum("ikn,kn->in", c, here["I2"]),
        "eta_dot": columns_of(now.state.rates, count), "turned": float(s.filter_frequency) * here["b"] - e2_dot,
        "B_r1": transposed(here["columns"], here["r1"]), "B_r1_dot": transposed(here["columns"], r1_dot),
        "B_turned_r1": transposed(turned, here["r1"]), "J": lambda x: np.einsum("ikn,kn->in", j, x),
        "fed_back": -float(s.gain_2) * here["r2"] - float(s.integral_2) * here["I2"],
        "low": float(bounds.inertia[0]), "high": float(bounds.inertia[1]), "u": float(bounds.thrust),
        "fz": float(bounds.vertical), "column": float(bounds.columns), "rates": float(bounds.rates),
        "r1_most": float(bounds.largest[R1]),
    }  # fmt: skip
    levels = [np.asarray(flow.level(flow.moved(now, h, force, torque))) for h in (H, -H)]
    return settings | found | {"level_rate": (levels[0] - levels[1]) / (2.0 * H)}


@pytest.mark.parametrize("line", LOOP.strip().splitlines())
def test_the_loop_of_the_law_obeys_the_equations(values, line):
    left, relation, right = Line(line, values).sides()
    assert relation == "="
    size = np.abs(left).max() + np.abs(right).max()
    assert size > 0.0
    assert np.abs(left - right).max() < SLACK * size


@pytest.mark.parametrize("line", [line for line in KNOWN.strip().splitlines() if "forall" not in line])
def test_the_loop_of_the_law_keeps_to_the_bounds(values, line):
    left, relation, right = Line(line, values).sides()
    assert relation == "<="
    assert np.all(left <= right + SLACK * (np.abs(left) + np.abs(right)))


def test_the_rate_of_the_level_is_that_of_the_chain_rule(values):
    rate, _, _ = Line(" ".join(LEVEL_RATE.split()), values).sides()
    assert np.abs(rate - values["level_rate"]).max() < SLACK * np.abs(rate).max()


@pytest.mark.parametrize("line", [line for line in KNOWN.strip().splitlines() if "forall" in line])
def test_the_inertia_is_the_matrix_that_is_supposed(values, line):
    """Linear by construction here; symmetric; between 0 and `high`."""
    draw, turn = np.random.default_rng(1), values["J"]
    x, y = draw.normal(size=(2, 3, len(values["thrust"])))
    assert np.allclose((x * turn(y)).sum(axis=0), (turn(x) * y).sum(axis=0))
    assert np.all((x * turn(x)).sum(axis=0) > 0.0)
    assert np.all((x * turn(x)).sum(axis=0) <= values["high"] * (x * x).sum(axis=0))
