"""One sign or index changed in a law makes at least one row fail.

A mutant is the law's own source with one place changed; only the code of the running functions is exchanged, and put back.
`python -m tests.mutations` makes many more, of which some run here.
"""

import ast
import importlib
from contextlib import suppress

import pytest

from quadstep.proofs.verify.registry import chosen, verify
from tests import mutations
from tests.equivalents import EQUIVALENT
from tests.mutations import REVIEWED, caught_by, exchanged, functions, source

LAGRANGE, KINEMATICS, ROTORS = "vehicle.paper", "vehicle.paper", "vehicle.paper"
LAW, NETS, FILTER = "control.backstepping", "interfaces.learning", "control.filters"
INVERSION, NESTED, JERK = "control.vectoring", "control.nested_saturation", "world.paths"
LINEAR, FUNCTIONS, LOG = "numbers.vectors", "numbers.elementary", "vehicle.in_space"

MUTANTS = [
    (KINEMATICS, "return matrix((-sin_theta", "return matrix((sin_theta", "T_eta"),
    (KINEMATICS, "(cos_theta * c, -s, 0.0))", "(cos_theta * c, s, 0.0))", "T_eta"),
    (KINEMATICS, "(cos_theta * s, c, 0.0)", "(cos_theta * s, -c, 0.0)", "4"),
    ("interfaces.plant", "return 2 if self", "return 1 if self", "T_eta"),
    (KINEMATICS, "matrix((-cos_theta,", "matrix((cos_theta,", "T_eta"),
    (KINEMATICS, "(-sin_theta * s,", "(sin_theta * s,", "T_eta"),
    (KINEMATICS, "(-cos_theta * s, -c, 0.0)", "(-cos_theta * s, c, 0.0)", "4"),
    (KINEMATICS, "return vector(-sin(theta)", "return vector(sin(theta)", "7"),
    (KINEMATICS, "cos(theta) * cos(phi))", "-cos(theta) * cos(phi))", "1"),
    (KINEMATICS, "cos(theta) * sin(phi), cos", "cos(phi) * sin(theta), cos", "thrust direction"),
    (LAGRANGE, "by[k][i, j] + by[j][i, k]", "by[k][i, j] - by[j][i, k]", "3"),
    (LAGRANGE, "by[j][i, k] - by[i][j, k]", "by[j][i, k] + by[i][j, k]", "6"),
    (LAGRANGE, "- by[i][j, k]", "- by[k][i, j]", "6"),
    (LAGRANGE, "return t_dot_momentum + t.T", "return t_dot_momentum - t.T", "2"),
    (LAGRANGE, "t_dot_rates) - Vector(", "t_dot_rates) + Vector(", "8"),
    (LAGRANGE, "thrust_direction(attitude) - weight", "thrust_direction(attitude) + weight", "1"),
    (LAGRANGE, "- weight + force", "- weight - force", "9"),
    (LAGRANGE, "torque - coriolis_torque", "torque + coriolis_torque", "3"),
    (LAGRANGE, "torque + moment", "torque - moment", "10"),
    (LAGRANGE, "half + half.T", "half - half.T", "4"),
    (LAGRANGE, "(moving + turning) + vehicle.mass", "(moving + turning) - vehicle.mass", "2"),
    (LAGRANGE, "0.5 * (moving + turning)", "0.5 * (moving - turning)", "2"),
    (LINEAR, "m13 * m23 - m12 * m33", "m13 * m23 + m12 * m33", "3"),
    (LINEAR, "m12 * m13 - m11 * m23", "m12 * m13 - m11 * m22", "3"),
    ("vehicle.paper", "x_dot * phi_dot", "x_dot * psi_dot", "67"),
    ("vehicle.paper", "products + disturbance.force", "products - disturbance.force", "67"),
    ("vehicle.paper", "products + disturbance.torque", "products - disturbance.torque", "67"),
    (ROTORS, "(l, 0.0, -l, 0.0)", "(l, 0.0, l, 0.0)", "5"),
    (ROTORS, "(0.0, -l, 0.0, l)", "(0.0, l, 0.0, -l)", "rotor signs"),
    (ROTORS, "(c, -c, c, -c)", "(-c, c, -c, c)", "rotor signs"),
    (ROTORS, "mean + roll + yaw", "mean - roll + yaw", "5"),
    (ROTORS, "mean + pitch - yaw", "mean + pitch + yaw", "5"),
    (ROTORS, "return u, vector(tau_psi, tau_theta, tau_phi)", "return u, vector(tau_phi, tau_theta, tau_psi)", "tau"),
    (INVERSION, "atan2(-f_x, b)", "atan2(f_x, b)", "50"),
    (INVERSION, "f_y * f_y + f_z * f_z", "f_y * f_y - f_z * f_z", "45"),
    (INVERSION, "f_x * f_x + b * b", "f_x * f_x - b * b", "48"),
    (INVERSION, "atan2(f_y, f_z)", "atan2(f_z, f_y)", "52"),
    (INVERSION, "atan2(f_y, f_z)", "atan2(f_y, -f_z)", "21"),
    (LAW, "0.0, -gains.mass * gains.gravity", "0.0, gains.mass * gains.gravity", "19"),
    (LAW, "* e1) - m_g", "* e1) + m_g", "20"),
    (LAW, "reference.acceleration - gains.slope_1", "reference.acceleration + gains.slope_1", "24"),
    (LAW, "gains.gain_1 * r1 + gains.integral_1", "gains.gain_1 * r1 - gains.integral_1", "19"),
    (LAW, "- m_g + estimate", "- m_g - estimate", "26"),
    (LAW, "return estimate + gains.gain_2", "return estimate - gains.gain_2", "37"),
    (LAW, "r2 + gains.integral_2", "r2 - gains.integral_2", "38"),
    (LAW, "return estimate + gains.gain_2 * r2", "return estimate + gains.gain_1 * r2", "35"),
    (LAW, "reference.position - measured.position", "reference.position + measured.position", "11"),
    (LAW, "measured.velocity) + gains.slope_1", "measured.velocity) - gains.slope_1", "12"),
    (LAW, "desired - measured.attitude", "desired + measured.attitude", "27"),
    (LAW, "measured.rates) + gains.slope_2", "measured.rates) - gains.slope_2", "28"),
    (LAW, "measured.rates) + gains.slope_2", "measured.rates) + gains.slope_1", "30"),
    (LAW, "memory.integral_1 + period", "memory.integral_1 - period", "19"),
    (LAW, "memory.integral_2 + period", "memory.integral_2 - period", "35"),
    (LAW, "memory.weights_1 + change_1", "memory.weights_1 - change_1", "54"),
    (LAW, "memory.weights_2 + change_2", "memory.weights_2 - change_2", "58"),
    (LAW, "r1 @ r1 + r2 @ r2", "r1 @ r1 - r2 @ r2", "54"),
    (LAW, "mu_1, learning * r1", "mu_1, learning * r2", "54"),
    (LAW, "(*measured.position, *r1", "(*measured.velocity, *r1", "23"),
    (LAW, "(*measured.attitude, *r1, *r2)", "(*measured.attitude, *r2, *r1)", "34"),
    (LAW, "t >= gains.learning_start", "t <= gains.learning_start", "23"),
    (LAW, "u_d, vector(theta_d, phi_d)", "u_d, vector(phi_d, theta_d)", "24"),
    (LAW, "memory.filtered, outer.tilt", "memory.filtered, -outer.tilt", "eta_d_dot"),
    (LAW, "stored_1 + stored_2", "stored_1 - stored_2", "55"),
    (NETS, "growth - (net.damping", "growth + (net.damping", "57"),
    (NETS, "net.learning_rate * mu", "-net.learning_rate * mu", "54"),
    (NETS, "return weights.T @ mu", "return -(weights.T @ mu)", "36"),
    (NETS, "total([row[-1], *", "total([-row[-1], *", "22"),
    (FUNCTIONS, "functions_of(x).sigmoid(x)", "functions_of(x).sigmoid(-x)", "33"),
    (FILTER, "exp(-(frequency", "exp((frequency", "eta_d_dot"),
    (FILTER, "filtered.rate + frequency", "filtered.rate - frequency", "eta_d_dot"),
    (FILTER, "offset + period", "offset - period", "eta_d_dot"),
    (FILTER, "filtered.rate - (frequency", "filtered.rate + (frequency", "eta_d_dot"),
    (JERK, "(-15.0 + 6.0 * s)", "(15.0 + 6.0 * s)", "71"),
    (JERK, "(-15.0 + 6.0 * s)", "(-15.0 - 6.0 * s)", "75"),
    (JERK, "per_time = 1.0 - s", "per_time = 1.0 + s", "68"),
    (JERK, "(1.0 - 2.0 * s)", "(1.0 + 2.0 * s)", "69"),
    (JERK, "way = parameters.end - parameters.start", "way = parameters.end + parameters.start", "70"),
    (JERK, "parameters.start + share * way", "parameters.start - share * way", "73"),
    (JERK, "parameters.yaw_end - parameters.yaw_start", "parameters.yaw_end + parameters.yaw_start", "68"),
    (LOG, "kinetic + command.stored", "kinetic - command.stored", "55"),
    (NESTED, "return -inner", "return inner", "[11]"),
    (NESTED, "coupling + inertia @ wanted", "coupling - inertia @ wanted", "[11]"),
    (NESTED, "-x_dot / g, -x / g", "x_dot / g, -x / g", "[11]"),
]


def mutated(place, old, new):
    """The laws of a module with one place of their source changed, in every module that uses them."""
    text = source(place)
    assert text.count(old) == 1, f"{old!r} stands {text.count(old)} times in {place}"
    return exchanged(place, ast.parse(text.replace(old, new)))


def test_there_are_enough_of_them():
    assert len({(place, old, new) for place, old, new, _ in MUTANTS}) == len(MUTANTS) >= 30


@pytest.mark.parametrize(("place", "old", "new", "number"), MUTANTS)
def test_a_changed_sign_or_index_turns_a_row_red(place, old, new, number):
    with mutated(place, old, new):
        (result,) = verify(chosen(number))
    assert not result.passed, f"row {number} holds although {old!r} is {new!r}"
    assert result.failure


def test_everything_is_put_back():
    places = {place: importlib.import_module(f"quadstep.{place}") for place, *_ in MUTANTS}

    def codes():
        return {
            (place, name): one.__code__
            for place, module in places.items()
            for name, one in functions(module, module.__name__).items()
        }

    before = codes()
    with mutated(*MUTANTS[0][:3]):
        assert codes() != before
    with suppress(ArithmeticError), mutated(*MUTANTS[-1][:3]):
        raise ArithmeticError
    assert codes() == before


SEED, COUNT = 5, 25


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("mutant", mutations.chosen(COUNT, SEED), ids=lambda mutant: mutant.name)
def test_a_small_mistake_is_seen(mutant):
    assert caught_by(mutant)


@pytest.mark.parametrize(
    "name", ["learning_bound: 0.5 -> 0.55", "Region(level, rate, ultimate, bounds, shape) -> Region(level, ultimate"]
)
def test_a_small_mistake_in_what_is_claimed_is_seen(name):
    """The first by the matrices of tests/theorem_again.py alone, the second by the region that was found before it."""
    mutant = next(one for one in mutations.all_mutants() if name in one.name)
    mutations.region.cache_clear()
    assert caught_by(mutant)


def test_those_that_a_review_found_to_survive_are_among_them_and_hundreds_more():
    every = mutations.all_mutants()
    assert len(REVIEWED) == 6
    assert [mutant.name for mutant in every[:6]] == [mutant.name for mutant in mutations.chosen(0, SEED)]
    assert len(every) > 1000
    assert all(any(mutant.name.startswith(start) for mutant in every) for start in EQUIVALENT)
    assert not caught_by(every[0]._replace(was="counter = command_filter", now="counter  = command_filter"))
