"""Poles and margins of the sampled loop: against finite differences, other formulas, and flights."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.linalg import expm
from scipy.optimize import brentq

from quadstep import Mission
from quadstep.control.vectoring import desired_attitude
from quadstep.engines.fly import fly
from quadstep.interfaces.controller import Controller
from quadstep.linear import equilibrium
from quadstep.linear.analysis import StepResponse, analyse_rest, of_loop, steps, worst_of
from quadstep.linear.equilibrium import at_rest, hovering
from quadstep.linear.grade import least_of
from quadstep.linear.nearby import MOVED
from quadstep.linear.run import captions, record, turned
from quadstep.linear.states import Channel, states, with_states
from quadstep.linear.tables import OpenLoop, mark_margins, merged, sentences
from quadstep.linear.transfer import frequencies, opened, transfer
from quadstep.linear.worst import by_channel, cells, facts, finding, grades
from quadstep.mission.paths import StepPath
from quadstep.numbers import Vector, vector, where
from quadstep.numbers.rotations import yaw_pitch_roll
from tests.altered import Delayed
from tests.quick_gains import QUICK

HOLD = {"type": "step", "start": [0.0, 0.0, 5.0], "end": [0.0, 0.0, 5.0], "duration": 10.0}


def hover(controller, latency=0.0, **more):
    """The vehicle of docs/linear.md."""
    return Mission(
        vehicle={"preset": "research-2.6kg"},
        path=HOLD,
        controller=controller,
        sensors={"fix_period": 0.004, "latency": latency},
        **more,
    )


KNOWN = {  # phase [deg], delay [ms], disk of roll; phase of thrust [deg]; slowest pole [1/s], latency 0 and 20 ms
    ("geometric", 0.0): (19.8, 13.0, 0.35, 26, -0.96),
    ("geometric", 0.02): (20.4, 15.6, 0.36, 20, -0.96),
    ("pid", 0.0): (16.4, 10.7, 0.29, 33, -0.50),
    ("lqr", 0.02): (25.3, 27.3, 0.44, 55, -0.79),
    ("rotation-backstepping", 0.0): (17.7, 13.8, 0.31, 67, -0.08),
}


@pytest.fixture(scope="module")
def found():
    """Each law once."""
    made = {}

    def of(controller, latency=0.0):
        key = controller, latency
        if key not in made:
            nets = {"nets": {"enabled": False}} if controller == "rotation-backstepping" else {}
            made[key] = analyse_rest(hover({"type": controller, **QUICK.get(controller, {}), **nets}, latency))
        return made[key]

    return of


@pytest.mark.parametrize("law", sorted({law for law, _ in KNOWN})[:3])
def test_a_report_begins_with_the_least_gain_margin_of_both_ways(found, law):
    analysis = found(law).analysis
    ends = [end for one in analysis.margins for end in (one.gain_up, 1.0 / max(one.gain_down, 1e-9))]
    fact = facts([("", analysis)])[0]
    assert fact.what == "smallest gain margin"
    assert fact.value == f"{20.0 * math.log10(min(ends)):.1f}\u00a0dB"


@pytest.mark.parametrize(("law", "latency"), KNOWN)
def test_margins_are_those_of_a_search_over_spectral_radii(found, law, latency):
    """Measured another way, by another program, before this one was written (no code in common but the laws)."""
    analysis = found(law, latency).analysis
    by_name = dict(zip([channel.name for channel in analysis.channels], analysis.margins, strict=True))
    phase, delay, disk, thrust, slowest = KNOWN[law, latency]
    roll = by_name["roll"]
    assert math.degrees(roll.phase) == pytest.approx(phase, abs=0.06)
    assert 1e3 * roll.delay == pytest.approx(delay, abs=0.06)
    assert roll.disk == pytest.approx(disk, abs=0.006)
    assert math.degrees(by_name["thrust"].phase) == pytest.approx(thrust, abs=0.6)
    assert analysis.poles[0].real == pytest.approx(slowest, abs=0.006)


def scaled(loop, channel, factor):
    """Largest growth in a period of a mode with this factor on a channel's command."""
    whole = np.eye(len(loop.period.names), dtype=complex)
    for tick in loop.period.ticks:
        after = tick.tasks @ whole
        more = (factor - 1.0) * np.outer(tick.acting[:, channel], after[loop.commands[channel]])
        whole = tick.step @ (after + more) - more
    return np.abs(np.linalg.eigvals(whole)).max()


@pytest.mark.parametrize(("law", "latency"), [("pid", 0.0), ("geometric", 0.02)])
def test_on_either_side_of_each_margin_the_loop_is_stable_and_not(found, law, latency):
    analysis = found(law, latency).analysis
    for i, one in enumerate(analysis.margins):
        turned = min((1.0, -1.0), key=lambda way: abs(scaled(analysis.loop, i, np.exp(1j * way * one.phase)) - 1.0))
        edges = [np.exp(1j * turned * one.phase)]
        edges += [gain for gain in (one.gain_up, one.gain_down) if 0.0 < gain < math.inf]
        for edge in edges:
            for share, stable in ((0.99, True), (1.01, False)):
                factor = np.exp(share * np.log(complex(edge)))
                assert (scaled(analysis.loop, i, factor) < 1.0) == stable, (i, edge, share)
        shrunk = 0.99 * one.disk * np.exp(1j * np.linspace(0.0, math.pi, 9))
        assert max(scaled(analysis.loop, i, (1.0 + d / 2.0) / (1.0 - d / 2.0)) for d in shrunk) < 1.0


def late(loop, channel, ticks):
    """Largest growth in a period with one channel's command so many ticks late, each command on its way a state."""
    count = len(loop.period.names)
    x, line = np.eye(count, count + ticks), np.eye(ticks, count + ticks, count)
    for tick in loop.period.ticks:
        x = tick.tasks @ x
        past = np.vstack([x[loop.commands[channel]], line])
        more = np.outer(tick.acting[:, channel], past[ticks] - past[0])
        x = tick.step @ (x + more) - more
        line = past[:-1]
    return np.abs(np.linalg.eigvals(np.vstack([x, line]))).max()


@pytest.mark.parametrize("law", ["pid", "lqr", "rotation-backstepping"])
def test_delay_margin_is_that_of_commands_kept_as_states(found, law):
    analysis = of_loop(found(law).rest.period)
    for i, one in enumerate(analysis.margins):
        ticks = one.delay / analysis.loop.period.step
        if ticks < 60:
            assert late(analysis.loop, i, math.floor(ticks)) < 1.0 < late(analysis.loop, i, math.ceil(ticks)), i


def test_margins_do_not_depend_on_how_often_the_integrator_steps_between_two_samples_of_the_law():
    slow = {"control_period": 0.004, "guidance_period": 0.012, "air_period": 0.012, "log_period": 0.012}
    once, often = (analyse_rest(hover({"type": "pid"}, simulation={**slow, "step": step})).analysis for step in (0.004, 0.001))
    assert len(often.loop.period.ticks) == 4 * len(once.loop.period.ticks)
    for one, other in zip(once.margins, often.margins, strict=True):
        assert other == pytest.approx(one, rel=2e-3)


def test_margins_do_not_depend_on_how_often_the_law_runs_until_all_loops_meet():
    """45 samples: values are followed one by one, and crossovers lie beyond half of the period's rate."""
    slow, controller = {"control_period": 0.004, "air_period": 0.004, "step": 0.004}, {"type": "lqr", **QUICK["lqr"]}
    once, often = (
        analyse_rest(hover(controller, simulation={**slow, "guidance_period": period, "log_period": period})).analysis
        for period in (0.008, 0.18)
    )
    assert sum(tick.sampled for tick in often.loop.period.ticks) == 45
    assert max(one.phase_at for one in often.margins) > 1.05 * math.pi / 0.18
    for one, other in zip(once.margins, often.margins, strict=True):
        assert other[2:] == pytest.approx(one[2:], rel=2e-3)
        assert other[:2] == pytest.approx(one[:2], rel=1.2e-2)  # 0.1 dB


def test_a_command_on_its_way_to_the_rotors_takes_its_delay_off_the_margin(found):
    """Two samples of 2 ms; of 6 ms, half a sample is that of the hold, and what is left is rounded."""
    vehicle = {"preset": "research-2.6kg", "command": {"speed": 800.0, "delay": 0.006}}
    mission = hover({"type": "pid", **QUICK["pid"]}).model_copy(
        update={"vehicle": Mission(vehicle=vehicle, path=HOLD).vehicle}
    )
    late, on_time = analyse_rest(mission).analysis, found("pid").analysis
    for channel, one, other in zip(late.channels, late.margins, on_time.margins, strict=True):
        assert one.delay == pytest.approx(other.delay - 0.004, abs=2e-5), channel.name


@pytest.mark.parametrize(("law", "periods"), [("geometric", {}), ("planned-lqr", {"plan": 0.04})])
def test_slopes_are_those_of_finite_differences(law, periods):
    """Of a whole period, in every state, away from hover as well: Richardson's rule on central differences.

    In a period of planned-lqr the law follows one plan for 20 samples, each at its own time since the plan was made.
    """
    simulation = {"loop_periods": periods}
    rest = at_rest(hovering(hover({"type": law}, 0.02, wind={"mean": [6.0, 2.0, 0.0]}, simulation=simulation)))
    loops, first = rest.loops, rest.first
    values = np.array(states(rest.flown))
    places = rest.period.places

    steps = 1e-4 * (1.0 + np.abs(values[places]))

    def flown(share):
        """Of each place in turn, all in one flight of arrays."""
        moved = np.repeat(values[:, None], len(places), axis=1)
        moved[places, np.arange(len(places))] += share * steps
        flown = loops.fly(with_states(rest.flown, list(moved)), first, first + loops.count)
        return np.array([np.broadcast_to(leaf, len(places)) for leaf in states(flown)])[places]

    coarse, fine = ((flown(share) - flown(-share)) / (2.0 * share * steps) for share in (2.0, 1.0))
    near, exact = (4.0 * fine - coarse) / 3.0, rest.period.map
    assert np.abs(near - exact).max() < 1e-6 * np.abs(exact).max()
    assert near == pytest.approx(exact, rel=1e-5, abs=1e-6)


@dataclass(frozen=True)
class Blind(Controller):
    """A controller that takes its vehicle to be where its path is, or to head there."""

    flown: Controller
    to: str

    def loops(self):
        return self.flown.loops()

    def start(self, *given):
        return self.flown.start(*given)

    def unseen(self, measured, reference):
        if self.to == "position":
            return reference._replace(position=measured.position)
        return reference._replace(yaw=yaw_pitch_roll(measured.attitude)[0])

    def slower(self, loop, memory, measured, reference, *given):
        return self.flown.slower(loop, memory, measured, self.unseen(measured, reference), *given)

    def law(self, memory, measured, reference, *given):
        return self.flown.law(memory, measured, self.unseen(measured, reference), *given)


@pytest.mark.parametrize(("to", "names"), [("position", ("x", "y", "z")), ("yaw", ("yaw",))])
def test_a_loop_that_does_not_hold_its_pose_is_only_marginally_stable_and_says_what_it_does_not_hold(found, to, names):
    """Its law never looks there, so no command depends on it; every other mode is damped."""
    assert found("geometric").analysis.holds
    plan = hovering(hover({"type": "geometric", **QUICK["geometric"]}))
    blind = of_loop(at_rest(plan._replace(loop=replace(plan.loop, controller=Blind(plan.loop.controller, to)))).period)
    assert blind.stable
    assert not blind.holds
    assert blind.not_held == names
    assert [pole.real for pole in blind.poles[: len(names)]] == [0.0] * len(names)
    assert blind.poles[len(names)].real < -0.1
    assert finding(blind) == (
        f"Hovering at the start of its path, the loop is unstable: it does not hold {', '.join(names)}; "
        "a deviation there never decays."
    )
    assert record(blind, [])["stable"] is False
    assert record(blind, [])["not_held"] == list(names)
    assert cells(blind)[:2] == ["unstable", ", ".join(["0", *(f"{name} not held" for name in names)])]
    assert grades([("blind", blind), ("seeing", found("geometric").analysis)]) == "1 of 2 loops is fragile, 1 unstable."


LATE = [("pid", 5), ("lqr", 12), ("geometric", 6)]
"""Laws, and how many samples of 2 ms late their commands may be."""


def test_the_page_has_these_figures(found):
    page = " ".join((Path(__file__).parents[1] / "docs" / "linear.md").read_text(encoding="utf-8").split())
    analysis = found("rotation-backstepping").analysis
    (roll,) = [m for c, m in zip(analysis.channels, analysis.margins, strict=True) if c.name == "roll"]
    low, high = (20.0 * math.log10(gain) for gain in (roll.gain_down, roll.gain_up))
    assert f"its roll margins are {low:.1f} to {high:.1f} dB, " in page
    assert f" dB, {math.degrees(roll.phase):.1f} degrees and {1e3 * roll.delay:.1f} ms this way" in page
    pid, lqr, geometric = ((2 * ticks, 2 * ticks + 2) for _, ticks in LATE)
    assert f"under `pid` decays with all commands {pid[0]} ms late and grows at {pid[1]} ms" in page
    assert f"under `lqr` this happens at {lqr[0]} and {lqr[1]} ms, under `geometric` at" in page
    assert f"at {geometric[0]} and {geometric[1]} ms." in page


@pytest.mark.parametrize(("law", "ticks"), LATE)
def test_flights_decay_below_the_delay_margin_and_grow_above_it(found, law, ticks):
    """All four commands late by whole samples of 2 ms, of which roll and pitch have the least margin."""
    rest = found(law).rest
    margin = min(one.delay for one in found(law).analysis.margins)
    assert 2e-3 * ticks < margin < 2e-3 * (ticks + 1)
    for late_by, grows in ((ticks, False), (ticks + 1, True)):
        loops = Delayed(rest, range(4), late_by)
        cycle = loops.begun.cycle
        turning = cycle.state._replace(rates=vector(1e-6, 0.0, 0.0))
        flown = loops.begun._replace(cycle=cycle._replace(state=turning))
        sizes, k = [], rest.first
        for _ in range(4):
            most = 0.0
            for _ in range(25):
                flown = loops.fly(flown, k, k + 5)
                most, k = max(most, abs(flown.cycle.state.rates[0])), k + 5
            sizes.append(most)
        assert (sizes[-1] > sizes[1]) == grows


def test_the_planar_vehicle_has_the_poles_and_margins_of_its_textbook_loop():
    """x'' = -g theta, theta'' = turn, sampled and held: the chain of integrators exactly, by SciPy's exponential."""
    k_p, k_v, k_theta, k_q, g, h = 4.0, 3.5, 120.0, 20.0, 9.81, 0.002
    mission = Mission(vehicle={"type": "planar"}, path=HOLD, controller={"type": "planar-pd"}, simulation={"step": h})
    analysis = analyse_rest(mission).analysis
    assert [channel.name for channel in analysis.channels] == ["thrust", "torque"]
    chain = np.zeros((5, 5))  # x, v, theta, theta', turn
    chain[0, 1], chain[1, 2], chain[2, 3], chain[3, 4] = 1.0, -g, 1.0, 1.0
    held = expm(h * chain)
    a, b = held[:4, :4], held[:4, 4]
    gains = np.array([k_theta * k_p / g, k_theta * k_v / g, -k_theta, -k_q])
    height = expm(h * np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]))
    up = height[:2, :2] - np.outer(height[:2, 2], [k_p, k_v])
    wanted = np.concatenate([np.linalg.eigvals(a + np.outer(b, gains)), np.linalg.eigvals(up)])
    s = np.log(wanted.astype(complex)) / h
    found = [
        complex(pole.real, sign * pole.imaginary) for pole in analysis.poles for sign in ((1, -1) if pole.imaginary else (1,))
    ]
    assert sorted(found, key=lambda one: (one.real, one.imag)) == pytest.approx(
        sorted(s, key=lambda one: (one.real, one.imag)), rel=1e-6
    )

    def loop(omega):
        return -gains @ np.linalg.solve(np.exp(1j * omega * h) * np.eye(4) - a, b)

    torque = analysis.margins[1]
    crossing = brentq(lambda omega: abs(loop(omega)) - 1.0, 5.0, 100.0)
    assert torque.phase_at == pytest.approx(crossing, rel=1e-6)
    assert torque.phase == pytest.approx(math.pi + np.angle(loop(crossing)), rel=1e-6)
    assert torque.gain_up == pytest.approx(1.0 / abs(loop(math.pi / h)), rel=1e-6)  # where its phase reaches -180 deg
    grid = np.geomspace(1.0, math.pi / h, 20_000)
    values = np.array([loop(omega) for omega in grid])
    assert torque.sensitivity == pytest.approx(np.abs(1.0 / (1.0 + values)).max(), rel=1e-5)
    assert torque.complementary == pytest.approx(np.abs(values / (1.0 + values)).max(), rel=1e-5)
    assert torque.disk == pytest.approx(np.abs(2.0 * (1.0 + values) / (1.0 - values)).min(), rel=1e-5)


@dataclass(frozen=True)
class Lopsided(Controller):
    """A controller whose torques are larger by these factors to either side, beyond a size [N m], and at rest neither."""

    flown: Controller
    plus: float
    minus: float
    beyond: float = 0.0

    def loops(self):
        return self.flown.loops()

    def start(self, *given):
        return self.flown.start(*given)

    def slower(self, *given):
        return self.flown.slower(*given)

    def law(self, *given):
        command, memory = self.flown.law(*given)
        torque = Vector(
            one * where(one > self.beyond, self.plus, where(one < -self.beyond, self.minus, 1.0)) for one in command.torque
        )
        return command._replace(torque=torque), memory


def test_a_loop_that_bends_at_rest_has_the_worst_margins_of_its_sides():
    plan = hovering(hover({"type": "pid"}, simulation={"guidance_period": 0.002}))

    def rest(*sides):
        return at_rest(plan._replace(loop=replace(plan.loop, controller=Lopsided(plan.loop.controller, *sides))))

    bent, plain, strong = rest(1.0, 1.4), rest(1.0, 1.0), rest(1.4, 1.4)
    assert not plain.pieces
    assert not strong.pieces
    assert any("test_linear.py" in place for place in bent.period.period.bends)
    sides = worst_of([of_loop(one) for one in (bent.period, *bent.pieces[:-MOVED])])
    ends = worst_of([of_loop(plain.period), of_loop(strong.period)])
    assert sides.bends
    for channel, one, other in zip(sides.channels, sides.margins, ends.margins, strict=True):
        if channel.name != "thrust":
            assert one.phase == pytest.approx(other.phase, rel=1e-6)
            assert one.delay == pytest.approx(other.delay, rel=1e-6)
            assert one.gain_up == pytest.approx(other.gain_up, rel=1e-6)
    assert bent.tried.startswith("33 one-sided linearisations (")
    said = sentences(sides._replace(tried=bent.tried, kinked=bent.kinked))[-1]
    assert (
        f"the worst of {bent.tried}, without the digits that depend on this choice. Curves, poles and steps show one" in said
    )
    kinked = sides._replace(tried=bent.tried, kinked=bent.kinked)
    exact, cut = ({name: row for name, *row in by_channel(one)[1]}["phase [°]"] for one in (sides, kinked))
    assert cut == [one if one == "none" else one[:-2] for one in exact]
    least = min(one.phase for one in sides.margins)
    assert [one.words for one in least_of(kinked)][1] == f"{math.floor(math.degrees(least))}°"
    assert [one.value for one in facts([("", kinked)])][1] == f"{math.floor(math.degrees(least))}°"

    near = rest(1.4, 1.4, 1e-7)
    assert not near.period.period.bends
    assert "state.rates.0" in near.near
    assert worst_of([of_loop(near.period)]).margins == of_loop(plain.period).margins
    around = worst_of([of_loop(one) for one in (near.period, *near.pieces)])
    for channel, one, other in zip(around.channels, around.margins, ends.margins, strict=True):
        if channel.name != "thrust":
            assert (one.phase, one.delay, one.gain_up) == pytest.approx((other.phase, other.delay, other.gain_up), rel=1e-3)
    said = sentences(around._replace(near=near.near, tried=near.tried, kinked=near.kinked))[-1]
    assert said.startswith("The law has a kink close to rest")
    assert "4 at states within 0.1 mm of it, without the digits that depend on this choice. Curves" in said


def test_a_modal_sum_is_the_response_that_equations_are_solved_for(found):
    for law in ("pid", "geometric"):
        loop = found(law).rest.period
        ready, omega = opened(loop), frequencies(loop)[::20]
        assert ready.modal is not None
        assert transfer(ready, omega) == pytest.approx(transfer(replace(ready, modal=None), omega), rel=1e-8, abs=1e-9)


def test_a_rest_is_reached_by_flying_where_newton_runs_into_a_limit():
    """In wind, with estimates that are bounded: a step of Newton's method from far away ends at the bounds."""
    wind = {"mean": [9.0, 0.0, 0.0]}
    adaptive = {"type": "geometric-adaptive"}
    analysis = analyse_rest(hover(adaptive, wind=wind)).analysis
    assert analysis.stable
    assert not analysis.not_held


def test_a_loop_whose_sides_are_alike_at_rest_is_not_flown_on_to_rest_elsewhere(monkeypatch):
    monkeypatch.setattr(equilibrium, "flown_to", lambda *_: pytest.fail("flown on"))
    mission = Mission(vehicle={"preset": "hummingbird"}, path=HOLD, controller={"type": "betaflight-rates"})
    found = at_rest(hovering(mission))
    assert found.period.period.bends
    assert found.tried == "9 one-sided linearisations (all alike)"


def test_a_step_is_judged_by_where_it_rests():
    t = np.linspace(0.0, 10.0, 1001)
    farther = StepResponse("yaw", "rad", t, 1.4 * (1.0 - np.exp(-t)))
    assert (farther.rest, farther.overshoot) == (pytest.approx(1.4, rel=1e-4), 0.0)
    assert farther.settling == pytest.approx(-np.log(0.02), abs=0.02)
    for values in (t, 0.0 * t):  # it drifts, or does not follow at all
        other = StepResponse("x", "m", t, values)
        assert (other.rest, other.settling) == (1.0, np.inf)


def test_how_much_farther_the_nose_turns_in_wind_is_what_flights_with_two_headings_do(found):
    law, wind = {"type": "rotation-backstepping", "nets": {"enabled": False}}, {"mean": [12.1, 0.0, 0.0]}
    ends = [
        fly(hovering(hover(law, wind=wind).model_copy(update={"path": StepPath(**HOLD, yaw=yaw)}))) for yaw in (-0.02, 0.02)
    ]
    flown = (ends[1].column("yaw")[-1] - ends[0].column("yaw")[-1]) / 0.04
    windy = analyse_rest(hover(law, wind=wind))
    (said,) = turned(moves := steps(windy.rest.period, windy.analysis.poles))
    assert flown > 1.1
    assert said == f"A small turn from this heading ends {100.0 * (flown - 1.0):.2g} % too large."
    far = fly(hovering(hover(law, wind=wind).model_copy(update={"path": StepPath(**HOLD, yaw=1.5)}))).column("yaw")[-1]
    assert far < 1.0 + 0.5 * flown  # 1.53 rad, not 2.07: the sentence is of small turns only
    assert f"% over its final value, {flown:.3g}; " in captions(windy.analysis, moves)["step"]
    still = found("rotation-backstepping")
    assert turned(steps(still.rest.period, still.analysis.poles)) == []
    less = StepResponse("yaw", "rad", np.arange(9.0), np.full(9, 0.8))
    assert turned([less]) == ["A small turn from this heading ends 20 % too small."]


@pytest.mark.parametrize("seed", range(20))
def test_the_nose_that_is_nearest_to_a_heading_turns_farther_than_it_where_the_thrust_leans_along_it(seed):
    """From above by 1/cos^2 of the lean, and by cos^2 of one across: 1.38 at the 31.7 degrees of examples/wind_tunnel.toml."""
    draw = np.random.default_rng(seed)
    heading, lean, aside = draw.uniform(-3.0, 3.0), draw.uniform(0.1, 1.2), draw.uniform(-1.5, 1.5)

    def nose(towards, turned=0.0):
        force = Vector((math.sin(lean) * math.cos(towards), math.sin(lean) * math.sin(towards), math.cos(lean)))
        none = Vector((0.0, 0.0, 0.0))
        return np.array(desired_attitude(force, none, none, heading + turned, 0.0).rotation)

    first, second, _ = nose(heading + aside).T
    others = [math.cos(angle) * first + math.sin(angle) * second for angle in np.linspace(0.0, 6.2, 100)]
    assert max(one @ [math.cos(heading), math.sin(heading), 0.0] for one in [*others, first]) == pytest.approx(
        first @ [math.cos(heading), math.sin(heading), 0.0]
    )
    for towards, gain in ((0.0, 1.0 / math.cos(lean) ** 2), (0.5 * math.pi, math.cos(lean) ** 2)):
        ends = [nose(heading + towards, turned)[:, 0] for turned in (-1e-6, 1e-6)]
        turn = math.remainder(math.atan2(ends[1][1], ends[1][0]) - math.atan2(ends[0][1], ends[0][0]), 2.0 * math.pi)
        assert turn / 2e-6 == pytest.approx(gain, rel=1e-5)


@pytest.mark.parametrize(("factor", "names"), [(1.001, ["thrust", "roll and pitch"]), (1.02, ["thrust", "roll", "pitch"])])
def test_channels_are_drawn_as_one_only_where_nobody_could_tell_them_apart(factor, names):
    omega = np.geomspace(0.1, 100.0, 50)
    roll = 10.0 / (1j * omega)
    loop = np.stack([1.0 / omega + 0j, roll, np.where(omega > 50.0, factor, 1.0) * roll], axis=1)
    channels = tuple(Channel(name, "N") for name in ("thrust", "roll", "pitch"))
    found = merged(OpenLoop(channels, omega, loop, None, [(2, 40.0, 10.0)], [(0, 6.0)]))
    assert [one.name for one in found.channels] == names
    assert (found.loop.shape[1], found.phases[0][0], found.gains[0][0]) == (len(names), len(names) - 1, 0)


@pytest.mark.parametrize("apart", [1.2, 1.5, 4.0])
def test_the_number_of_a_margin_stands_where_no_curve_and_no_other_bar_is(apart):
    figure, omega = Figure(figsize=(9.0, 4.0)), np.geomspace(1.0, 100.0, 400)
    above, below = figure.subplots(1, 2)
    phase = -180.0 + 60.0 * np.cos(np.log(omega / 10.0))
    for axes, lines in ((above, (20.0 - 20.0 * np.log10(omega), np.full(400, 2.4))), (below, (phase,))):
        axes.set_xscale("log")
        for line in lines:
            axes.plot(omega, line)
    phases = [(0, float(np.interp(at, omega, phase)) + 180.0, at) for at in (10.0, 10.0 * apart)]
    figure.draw_without_rendering()
    mark_margins(above, below, OpenLoop((), omega, omega, None, phases, ()))
    boxes = [one.get_window_extent() for one in below.texts]
    assert len(boxes) == 2 and not boxes[0].overlaps(boxes[1])
    for box in boxes:
        for line in below.lines:
            x, y = below.transData.transform(line.get_xydata()).T
            points = np.stack([np.interp(np.linspace(0, 1, 500), np.linspace(0, 1, len(x)), one) for one in (x, y)], axis=1)
            assert not np.all((points > box.min) & (points < box.max), axis=1).any()
