"""L along the closed loop: T9 to T12, emitted from the shipped laws, the shipped plant and `theory.lyapunov`.

Nothing of the loop is left out: a part that stands in many places (r1, J, the law's torque, ...) gets a name, and the
statement says what it is.
"""

from typing import NamedTuple

from proofs.laws import NEURONS
from proofs.statement import Claim, Setting, Statement, above, at_most, differs, equal, matrix_of, state, suppose, vector_of
from proofs.terms import variable
from quadstep.control.backstepping import (
    FORCE_INPUTS,
    TORQUE_INPUTS,
    BacksteppingGains,
    BacksteppingMemory,
    desired_force,
    following_memory,
    torque_basis,
)
from quadstep.control.completed_backstepping import CompletedGains, CompletedMemory, counter_rate, coupling_columns, with_yaw
from quadstep.control.filters import Filtered, command_filter
from quadstep.control.vectoring import shrink
from quadstep.interfaces.learning import Net, output
from quadstep.interfaces.plant import Reference
from quadstep.numbers import Matrix, Vector, absolute, cos, exp, largest, smallest, sqrt, total
from quadstep.proofs.theory.lyapunov import STANDARD, ErrorMotion, closed_loop, lyapunov_rate, sum_squares
from quadstep.proofs.theory.trials import LoopBatch
from quadstep.vehicle.paper import Rotors, State, Vehicle, coriolis_torque, thrust_direction

SERIES = 1e-17
"""What T1_near leaves of the gap of both directions, entry by entry."""


def any_loop() -> LoopBatch:
    """A closed loop of variables; the controller knows mass, inertia and gravity."""
    mass, inertia, gravity, kappa = variable("m"), vector_of("s"), variable("g"), variable("kappa")
    net_1 = Net(matrix_of("xa", NEURONS, FORCE_INPUTS + 1), variable("fa"), kappa)
    net_2 = Net(matrix_of("xb", NEURONS, TORQUE_INPUTS + 1), variable("fb"), kappa)
    paper = BacksteppingGains(
        mass=mass, gravity=gravity,
        slope_1=vector_of("la"), gain_1=vector_of("ka"), integral_1=vector_of("ia"),
        slope_2=vector_of("lb"), gain_2=vector_of("kb"), integral_2=vector_of("ib"),
        filter_frequency=variable("w"),
        force_net=net_1, torque_net=net_2, learning_start=0.0,
        weights_1=matrix_of("ua", NEURONS), weights_2=matrix_of("ub", NEURONS),
    )  # fmt: skip
    filtered, counter = (Filtered(vector_of(name, 2), vector_of(f"{name}r", 2)) for name in ("z", "c"))
    before = BacksteppingMemory(vector_of("na"), vector_of("nb"), filtered, paper.weights_1, paper.weights_2)
    return LoopBatch(
        vehicle=Vehicle(mass, inertia, gravity, Rotors(0.0, 0.0, 0.0, 0.0)),
        state=State(vector_of("p"), vector_of("v"), Vector(map(variable, ("psi", "theta", "phi"))), vector_of("q")),
        reference=Reference(
            vector_of("pd"), vector_of("vd"), vector_of("ad"), variable("yaw"), variable("yawr"),
            yaw_acceleration=variable("yawa"),
        ),
        gains=CompletedGains(paper, vector_of("pp"), inertia, vector_of("wmax", 2), vector_of("nmax", 2)),
        memory=CompletedMemory(before, counter),
        ideal=(matrix_of("wa", NEURONS), matrix_of("wb", NEURONS)),
        residual=(vector_of("da"), vector_of("db")),
        period=variable("period"),
    )  # fmt: skip


class Loop(NamedTuple):
    """A closed loop of variables, and what is supposed of it.

    plant: under any torque. closed: the law on it, which closes the loop.
    """

    sample: LoopBatch
    motion: ErrorMotion
    plant: Setting
    closed: Setting

    @property
    def lacking(self) -> Vector:
        """What B e2 lacks of n(eta_f) - n(eta)."""
        b_theta, b_phi = coupling_columns(tilt(self.sample), self.sample.memory.paper.filtered.value)
        return gap(self.sample) - (b_theta * self.motion.e2[1] + b_phi * self.motion.e2[2])


def tilt(loop: LoopBatch) -> Vector:
    """(theta, phi)."""
    return Vector(loop.state.attitude.entries[1:])


def direction(of: Vector) -> Vector:
    """n of a tilt."""
    return thrust_direction(with_yaw(0.0, of))


def gap(loop: LoopBatch) -> Vector:
    """n(eta_f) - n(eta)."""
    return direction(loop.memory.paper.filtered.value) - direction(tilt(loop))


def plant_of(loop: LoopBatch, motion: ErrorMotion) -> Setting:
    """The plant, its names and the inversion of the wanted force; b: the torque that acts on it, whatever law asks for it."""
    paper, before, outer, state_now = loop.gains.paper, loop.memory.paper, motion.outer, loop.state
    estimate, e1 = 1.0 * output(before.weights_1, outer.mu_1), loop.reference.position - state_now.position
    b_theta, b_phi = coupling_columns(tilt(loop), before.filtered.value)
    mass, inertia = loop.vehicle.mass, loop.vehicle.inertia
    return suppose(
        "plant",
        [*(above(number, 0.0) for number in (mass, *inertia)), differs(cos(state_now.attitude[1]), 0.0)],
        {
            "ra": outer.r1, "mua": outer.mu_1,
            "f": desired_force(paper, loop.reference, e1, outer.r1, before.integral_1, estimate),
            "u": outer.u_d, "tilt": outer.tilt, "e": motion.e2, "bt": b_theta, "bp": b_phi,
            "j": motion.j, "c": motion.c, "jd": motion.j_dot,
            "ct": coriolis_torque(state_now.attitude, state_now.rates, inertia, STANDARD),
            "acc": motion.eta_dd, "rad": motion.r1_dot,
        },
        later={"b": motion.pushed},
    )  # fmt: skip


def loop_of(completed: bool) -> Loop:
    """The completed law's, or the paper's."""
    loop = any_loop()
    motion, paper, before, period = closed_loop(loop, completed), loop.gains.paper, loop.memory.paper, loop.period
    r1, r2, frequency = motion.outer.r1, motion.r2, paper.filter_frequency
    mu_2 = torque_basis(paper, loop.state, r1, r2)
    names: dict[str, object] = {
        "decay": exp(-(frequency * period)), "rb": r2, "mub": mu_2, "n": sqrt(r1 @ r1 + r2 @ r2),
        "wd": (motion.following.filtered.rate - before.filtered.rate) / period,
    }  # fmt: skip
    positive = [period, frequency, paper.force_net.learning_rate, paper.torque_net.learning_rate, *loop.gains.coupling]
    given = [above(number, 0.0) for number in positive]
    if completed:
        own = counter_rate(loop.gains, motion.outer.u_d, tilt(loop), before.filtered.value, r1)
        turned = command_filter(loop.memory.counter, own, frequency, period).value
        names |= {"own": own, "raw": motion.raw_counter, "cd": (turned - loop.memory.counter.value) / period}
        following = following_memory(paper, before, motion.outer, mu_2, r2, period, 1.0)
        after: list[Vector | Matrix] = [following.integral_1, following.integral_2, following.weights_1, following.weights_2]
        kept = zip(after, (*loop.gains.integral_bounds, *loop.gains.weight_bounds), strict=True)
        for i, (part, bound) in enumerate(kept):  # projection changes nothing; T8 says what it does where it does
            names |= {f"size{i}": part.norm(), f"keep{i}": shrink(part.norm(), bound)}
            given.append(at_most(part.norm(), bound))
    names |= {"tau": motion.torque, "b": motion.pushed, "rbd": motion.r2_dot}
    plant = plant_of(loop, motion)
    return Loop(loop, motion, plant, suppose("completed_loop" if completed else "paper_loop", given, names, plant))


def statements_of_plant() -> list[Statement]:
    """Equations of the outer and of the inner loop as the theorem has them, from the plant's own accelerations."""
    loop, motion, plant, _ = whole = loop_of(completed=True)
    paper, before, outer, y, e2 = loop.gains.paper, loop.memory.paper, motion.outer, vector_of("y"), motion.e2
    wanted, flown = outer.u_d * direction(outer.tilt), outer.u_d * direction(tilt(loop))
    unknown = output(loop.ideal[0] - before.weights_1, outer.mu_1) + loop.residual[0]
    fed_back = (paper.gain_1 - loop.vehicle.mass * paper.slope_1) * outer.r1 + paper.integral_1 * before.integral_1
    most, least, slope = (variable(name) for name in ("most", "least", "slope"))
    return [
        state("thrust", "u_d >= 0", at_most(0.0, outer.u_d), base=plant),
        state("turning", "T2 with the names of a loop",
              at_most(gap(loop) @ gap(loop), e2[1] * e2[1] + e2[2] * e2[2]), base=plant),
        state("gain", "T5 with the names of a loop",
              at_most((least - 2.0 * most * slope) * (y @ y), y @ (paper.gain_2 * y) - y @ (motion.j @ (paper.slope_2 * y))),
              [*(at_most(entry, most) for entry in loop.vehicle.inertia), *(above(entry, 0.0) for entry in paper.slope_2),
               *(at_most(entry, slope) for entry in paper.slope_2), *(at_most(least, entry) for entry in paper.gain_2)],
              base=plant),
        state("series", "what the series in B leaves of the gap, entry by entry",
              at_most(whole.lacking.map(absolute), Vector([SERIES] * 3)), base=plant),
        state("no_series", "it leaves nothing where the angles are apart",
              equal(whole.lacking, Vector([0.0] * 3)), apart(loop), base=plant),
        state("outer_loop", "m r1_dot = u (n(eta_d) - n(eta)) + W~^T mu + eps - (K_r1 - m Lambda_1) r1 - K_i1 int r1",
              equal(loop.vehicle.mass * motion.r1_dot, wanted - flown + unknown - fed_back), base=plant),
        state("inner_loop", "J eta_dd + C eta_dot = tau + A_eta",
              equal(motion.j @ motion.eta_dd + motion.c @ loop.state.rates, motion.pushed), base=plant),
        state("skew", "y^T J_dot y = 2 y^T C y", equal(y @ (motion.j_dot @ y), 2.0 * (y @ (motion.c @ y))), base=plant),
        state("symmetric", "J^T = J", equal(motion.j.T, motion.j), base=plant),
    ]  # fmt: skip


def apart(loop: LoopBatch) -> list[Claim]:
    """Both angles are far enough from the filtered ones for B to be without its series."""
    return [at_most(1e-3, absolute(error)) for error in loop.memory.paper.filtered.value - tilt(loop)]


def statements_of(completed: bool) -> list[Statement]:
    """Of the completed or of the paper's law: the rate of L for all angles, then as the page has it, then its bound."""
    loop, motion, _, closed = whole = loop_of(completed)
    rate, paper, r1, u = lyapunov_rate(loop, completed), loop.gains.paper, motion.outer.r1, motion.outer.u_d
    identity, bound = total(rate.identity.values()), total(rate.bound.values())
    near = SERIES * (u * total(absolute(entry) for entry in r1))
    gains = [above(paper.force_net.damping, 0.0), *(above(entry, 0.0) for entry in paper.slope_2)]
    law, (exact, bounded) = ("the completed law", ("T9", "T10")) if completed else ("the paper's law", ("T11", "T12"))
    return [
        state(f"{exact}_all", f"L_dot of {law}, with what the series in B leaves of the gap",
              equal(rate.flown, identity + u * (r1 @ whole.lacking)), base=closed),
        state(exact, f"L_dot of {law} is the theorem's", equal(rate.flown, identity), apart(loop), base=closed),
        state(f"{exact}_near", "the same for all angles, up to 1e-17 u |r1|_1",
              at_most(absolute(rate.flown - identity), near), base=closed),
        state(bounded, f"L_dot of {law} <= its bound", at_most(rate.flown, bound + near if completed else bound), gains,
              lengths_of(loop, completed), closed),
    ]  # fmt: skip


def lengths_of(loop: LoopBatch, completed: bool) -> dict[str, object]:
    """The lengths and the least and largest gains that bounds are made of."""
    motion, paper, before = closed_loop(loop, completed), loop.gains.paper, loop.memory.paper
    p = weight_of(loop, completed)
    r1, r2, outer = motion.outer.r1, motion.r2, motion.outer
    pairs = list(zip(loop.ideal, (before.weights_1, before.weights_2), strict=True))
    wrong = direction(outer.tilt) - direction(before.filtered.value)
    return {
        "len1": r1.norm(), "len2": r2.norm(), "lene": motion.e2.norm(), "lag": (outer.u_d * wrong).norm(),
        "slip": (p * (motion.raw_counter - motion.counter)).norm() if completed else 0.0,
        "we": sqrt(total(sum_squares(w - w_hat) for w, w_hat in pairs)),
        "wi": sqrt(total(sum_squares(w) for w in loop.ideal)), "de": sqrt(total(e @ e for e in loop.residual)),
        "least1": smallest(paper.gain_1 - loop.vehicle.mass * paper.slope_1),
        "least2": smallest(paper.gain_2), "leastp": smallest(p * paper.slope_2), "most2": largest(paper.slope_2),
        "sigma": largest(loop.vehicle.inertia),
    }  # fmt: skip


def weight_of(loop: LoopBatch, completed: bool) -> Vector:
    """P of L; p I for the paper's law."""
    return loop.gains.coupling if completed else Vector([loop.gains.coupling[0]] * 3)


def statements() -> list[Statement]:
    """T9 to T12, and what they rest on."""
    return [*statements_of_plant(), *statements_of(completed=True), *statements_of(completed=False)]
