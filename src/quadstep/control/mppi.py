"""Model predictive path integral control: perturbed plans are simulated, and averaged with weights by their cost.

Williams, Aldrich, Theodorou (2017). A plan is an acceleration beside the path's for each stage of a horizon. `guide`
perturbs it with noise of the flight's own, rolls a point whose acceleration lags out along each perturbed plan, within the
rotors' reach of the acceleration that the path requires at that stage (`reference.ahead`), weighs the plans by exp(-cost /
temperature) and keeps their mean. `law` makes thrust and torque of the plan's first stage, as in `geometric.py`. The number
of samples is fixed: turns of a loop.
"""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from quadstep.control.filters import observed
from quadstep.control.vectoring import Turn, attitude_for, errors_to, project, torque_for, turned, up_axis, within
from quadstep.interfaces.controller import Command, Controller, Measured
from quadstep.interfaces.gain import believed, from_gains, gain, given, usual
from quadstep.interfaces.plant import Reference
from quadstep.numbers import Matrix, Number, Vector, exp, matrix, minimum, scan, vector, where
from quadstep.numbers.noise import Key, normals
from quadstep.numbers.rotations import rotation_matrix

SAMPLES, STAGES, STAGE = 64, 12, 0.05
"""Plans that are tried, stages of each, and how long one is [s]."""

STREAM = 2**24
"""Of the flight's noise."""

MOST_DRAWS = 2.0**23
"""Then the counter of draws restarts, while it is a whole number in f32 too: after three minutes."""

KEPT, FRESH = 0.8, 0.6
"""What the next stage keeps of a perturbation, as slow ones move the vehicle and quick ones do not; what is new in it. Their
squares add up to 1.
"""

WORST = 1e30
"""More than any plan costs."""


class MppiGains(NamedTuple):
    """The vehicle parameters that the controller assumes, what a plan costs a stage, what is tried, and the attitude loop."""

    mass: Number = believed("mass")
    inertia: Vector = believed("inertia")
    gravity: Number = given(lambda model: model.gravity)
    most_thrust: Number = given(lambda model: model.most_thrust)
    position: Number = gain(60.0, "1/m^2", "cost of the squared position error")
    velocity: Number = gain(6.0, "s^2/m^2", "cost of the squared velocity error")
    effort: Number = gain(0.05, "s^4/m^2", "cost of the squared deviation from the path's acceleration", zero=True)
    last: Number = gain(3.0, "-", "cost of the last stage relative to the others")
    temperature: Number = gain(4.0, "-", "extra cost that divides a plan's weight by e", symbol="lambda")
    deviation: Vector = gain(usual(2.5, 2), "m/s^2", "standard deviation of the perturbed accelerations")
    lag: Number = gain(
        from_gains(lambda gains, model: gains.turn_damping[0] / gains.turn_stiffness[0] + model.lag),
        "s", "time constant with which acceleration follows the command", tunable=False,
    )  # fmt: skip
    observer: Number = gain(usual(8.0, 1), "1/s", "bandwidth of the acceleration observer", zero=True)
    most_disturbance: Number = gain(8.0, "m/s^2", "largest estimated acceleration")
    turn_stiffness: Vector = gain(
        usual((270.0, 270.0, 70.0), 2, "body"), "1/s^2", "stiffness of attitude, over inertia", key="k_R"
    )
    turn_damping: Vector = gain(
        usual((35.0, 35.0, 17.0), 1, "rate"), "1/s", "damping of attitude, over inertia", key="k_Omega"
    )


class MppiMemory(NamedTuple):
    """plan: accelerations beside the path's, a row a stage [m/s^2]. drawn: how often noise has been drawn.

    velocity [m/s]: estimated; push: acceleration that is not explained [m/s^2].
    """

    plan: Matrix
    drawn: Number
    velocity: Vector
    push: Vector


class Rollout(NamedTuple):
    """A point on its way: errors of position [m] and velocity [m/s], its acceleration beside the path's, and the perturbation
    [m/s^2]; the cost so far; how often noise has been drawn.
    """

    position: Vector
    velocity: Vector
    acceleration: Vector
    perturbation: Vector
    cost: Number
    drawn: Number


class PlanMean(NamedTuple):
    """Of the plans so far. least: their least cost. weight: sum of exp((least - cost) / temperature); perturbations: so
    weighed too. size: 0 for the first plan, which is the one that there is, then 1.
    """

    least: Number
    weight: Number
    perturbations: Matrix
    size: Number
    drawn: Number


@dataclass(frozen=True)
class Mppi(Controller):
    """`guide` plans, `law` follows the plan's beginning."""

    name = "mppi"
    label = "model predictive path integral"
    source = "Williams, Aldrich, Theodorou 2017"
    Gains = MppiGains
    also_measures = ("noise",)
    preview: ClassVar[tuple[float, ...]] = tuple(STAGE * stage for stage in range(1, STAGES))
    rates: ClassVar = {"guide": 0.02, "law": 0.002}

    def start(self, measured: Measured, gains: MppiGains) -> MppiMemory:
        """A plan of nothing beside the path."""
        zero = vector(0.0, 0.0, 0.0)
        return MppiMemory(Matrix([zero] * STAGES), 0.0, measured.velocity, zero)

    def guide(
        self, memory: MppiMemory, measured: Measured, reference: Reference, gains: MppiGains, t: Number, period: Number
    ) -> MppiMemory:
        """The plan moved on by a period, and improved."""
        share = period / STAGE
        later = (*memory.plan.rows[1:], memory.plan.rows[-1])
        plan = Matrix(now + share * (then - now) for now, then in zip(memory.plan, later, strict=True))
        up = vector(0.0, 0.0, gains.gravity)
        wanted = Matrix(stage.acceleration - memory.push + up for stage in (reference, *reference.ahead))
        ends = matrix(*((gains.last if stage == STAGES - 1 else 1.0,) for stage in range(STAGES)))
        away = measured.position - reference.position, measured.velocity - reference.velocity
        drawn = where(memory.drawn < MOST_DRAWS, memory.drawn, 0.0)
        mean = self.average(away, (plan, wanted, ends), gains, measured.noise, drawn)
        return memory._replace(plan=plan + mean.perturbations * (1.0 / mean.weight), drawn=mean.drawn)

    def average(
        self, away: tuple[Vector, Vector], stages: tuple[Matrix, Matrix, Matrix], gains: MppiGains, noise: Key, drawn: Number
    ) -> PlanMean:
        """All samples, weighed as they come. stages: the plan, the specific force that the path wants, and costs' factors."""

        def sample(mean: PlanMean, _: tuple[()]) -> tuple[PlanMean, tuple[()]]:
            end, perturbations = self.rolled_out(away, stages, gains, noise, mean)
            least = minimum(mean.least, end.cost)
            kept = exp((least - mean.least) * (1.0 / gains.temperature))
            share = exp((least - end.cost) * (1.0 / gains.temperature))
            weighed = kept * mean.perturbations + share * perturbations
            return PlanMean(least, kept * mean.weight + share, weighed, 1.0, end.drawn), ()

        none = Matrix([vector(0.0, 0.0, 0.0)] * STAGES)
        mean, _ = scan(sample, PlanMean(WORST, 0.0, none, 0.0, drawn), times=SAMPLES)
        return mean

    @staticmethod
    def rolled_out(
        away: tuple[Vector, Vector], stages: tuple[Matrix, Matrix, Matrix], gains: MppiGains, noise: Key, mean: PlanMean
    ) -> tuple[Rollout, Matrix]:
        """The end of one perturbed plan, and its perturbations, a row a stage."""
        zero = vector(0.0, 0.0, 0.0)
        follows = 1.0 - exp(-(STAGE / gains.lag))

        def stage(now: Rollout, row: tuple[Vector, Vector, Vector]) -> tuple[Rollout, Vector]:
            planned, wanted, factor = row
            fresh = normals(noise, STREAM, now.drawn, 3)
            perturbation = KEPT * now.perturbation + FRESH * (mean.size * (gains.deviation * fresh))
            asked = wanted + planned + perturbation
            had = within(gains.mass * asked, gains.most_thrust) * (1.0 / gains.mass) - wanted
            acceleration = now.acceleration + follows * (had - now.acceleration)
            velocity = now.velocity + STAGE * acceleration
            position = now.position + STAGE * (now.velocity + (0.5 * STAGE) * acceleration)
            effort = planned + perturbation
            cost = gains.position * (position @ position) + gains.velocity * (velocity @ velocity)
            cost = now.cost + factor[0] * cost + gains.effort * (effort @ effort)
            return Rollout(position, velocity, acceleration, perturbation, cost, now.drawn + 1.0), perturbation

        begin = Rollout(*away, stages[0].rows[0], zero, 0.0, mean.drawn)
        end, perturbations = scan(stage, begin, stages)
        return end, perturbations

    def law(
        self, memory: MppiMemory, measured: Measured, reference: Reference, gains: MppiGains, t: Number, period: Number
    ) -> tuple[Command, MppiMemory]:
        """One sample: the plan's first acceleration as a force, and the attitude that makes it."""
        up = vector(0.0, 0.0, gains.gravity)
        asked = reference.acceleration + memory.plan.rows[0] - memory.push
        force = within(gains.mass * (asked + up), gains.most_thrust)
        wanted, axis = attitude_for(force, reference, gains.mass), up_axis(rotation_matrix(measured.attitude))
        angular = turned(errors_to(wanted, measured), Turn(gains.turn_stiffness, gains.turn_damping))
        command = Command(force @ axis, torque_for(angular, measured, gains), wanted.angles)
        made = (measured.thrust / gains.mass) * axis - up
        velocity, push = observed(memory.velocity, memory.push, measured.velocity, made, gains.observer, period)
        return command, memory._replace(velocity=velocity, push=project(push, gains.most_disturbance))
