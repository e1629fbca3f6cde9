"""Derived from a gain's declaration: keys, checks, lines of `quadstep new`, units, sliders, searches, conditions."""

import json
import tomllib
from dataclasses import dataclass, fields
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import NamedTuple

import numpy as np
import pytest

import quadstep.control
from quadstep.control.backstepping import Backstepping
from quadstep.control.lqr import Lqr, LqrGains, LqrWeights
from quadstep.control.rate_loop import following_rates
from quadstep.control.registry import BUILT_IN, controllers
from quadstep.interfaces.controller import Command, Condition, Controller, Measured
from quadstep.interfaces.gain import AXES, Gain, StatedGains, Undecided, believed, declared, from_gains, gain, given, usual
from quadstep.interfaces.learning import Learning, Net, net, nets_start, weights
from quadstep.interfaces.plant import Model
from quadstep.io.errors import UserError
from quadstep.mission.check import check
from quadstep.mission.derived import section_of
from quadstep.mission.fields import label
from quadstep.mission.listings import controller_lines, load_preset
from quadstep.mission.read import check_mission
from quadstep.numbers import Matrix, Number, Vector, absolute, flatten, leaf_names, sin, smallest, vector
from quadstep.page.controllers import OPERATIONS, page_conditions, sliders
from quadstep.studies.tuning.gains import gain as gain_of
from quadstep.studies.tuning.gains import tunable, with_gains
from quadstep.vehicle.paper import State
from quadstep.vehicle.planar import PlanarState
from tests.pages import needs_node, run_node, value_of

MODEL = Model(mass=2.0, inertia=vector(0.1, 0.2, 0.25), gravity=9.81, most_thrust=40.0, agility=0.5)
ANY_LAW = [law for kind in BUILT_IN for law in controllers(kind).values()]


class InnerGains(NamedTuple):
    mass: Number = believed("mass")
    k_v: Vector = gain(usual((3.0, 4.0, 5.0), 2), "1/s", "velocity", low=0.5, high=60.0)


class SlidingGains(NamedTuple):
    inner: InnerGains
    k_i: Vector = gain(from_gains(lambda gains, _: gains.inner.k_v / 15.0), "1/s^2", "integral of position", zero=True)
    most_thrust: Number = given(lambda model: model.most_thrust)
    most_speed: Number = gain(3.0, "m/s", "largest speed", tunable=False)
    edges: Vector = gain((1.0, 2.0), "-", "of the layer", symbol="phi", key="layer", parts=("inner", "outer"))
    net: Net = net(1, 4, rate=usual(8.0, 1), damping=0.1)
    start: Number = nets_start()
    weights: Matrix = weights(1)


@dataclass(frozen=True)
class Sliding(Controller):
    """A controller of which nothing is said elsewhere."""

    name = "sliding"
    label = "sliding mode"
    Gains = SlidingGains

    def law(self, memory, measured, reference, gains, t, period):
        return Command(gains.inner.mass, measured.rates), ()

    def conditions(self, gains, model):
        room = smallest(gains.inner.k_v) * model.mass
        return [
            *(
                Condition(f"k_v ({axis}) > |k_i|", k_v, absolute(k_i), "the text")
                for axis, k_v, k_i in zip(AXES, gains.inner.k_v, gains.k_i, strict=True)
            ),
            Condition("outer >= 2 inner", gains.edges[1], 2.0 * gains.edges[0], "the book", key="layer"),
            Condition("min k_v m > 3: room", room, 3.0, "the appendix", warned=False),
        ]


@dataclass(frozen=True)
class Slower(Sliding):
    """The same with other defaults."""

    name = "slower"
    defaults = {"inner.k_v": 2.0, "most_speed": from_gains(lambda gains, _: gains.inner.mass)}  # noqa: RUF012


class Vehicle(NamedTuple):
    known: Model = MODEL

    def model(self):
        return self.known


def section(law=Sliding, **keys):
    return section_of(law).model_validate({"type": law.name, **keys})


def built(law=Sliding, **keys):
    return section(law, **keys).build(Vehicle(), Path()).gains


def test_gains_that_are_left_out_follow_from_the_vehicle_and_from_each_other():
    gains = built()
    assert gains.inner.mass == 2.0
    assert list(gains.inner.k_v) == [0.75, 1.0, 1.25]
    assert list(gains.k_i) == [0.75 / 15.0, 1.0 / 15.0, 1.25 / 15.0]
    assert (gains.most_thrust, gains.most_speed) == (40.0, 3.0)
    assert (gains.net.learning_rate, gains.net.damping, gains.start) == (4.0, 0.1, 0.0)
    assert (len(gains.weights), len(gains.net.input_weights)) == (10, 10)
    assert flatten(gains) == flatten(Sliding.gains(MODEL))


def test_what_a_mission_says_goes_before_and_others_follow_it():
    gains = built(mass=3.0, k_v=6.0, layer=[3.0, 9.0], nets={"F1": 2.0, "neurons": 3, "enabled": False})
    assert (gains.inner.mass, list(gains.k_i), list(gains.edges)) == (3.0, [0.4] * 3, [3.0, 9.0])
    assert (gains.net.learning_rate, gains.start, len(gains.weights)) == (2.0, np.inf, 3)
    assert list(built(k_i=0.0).k_i) == [0.0] * 3
    saved = Learning(neurons=1, weights=(Matrix([vector(1.0, 2.0, 3.0)]),) * 2)
    assert list(Sliding.gains(MODEL, {}, saved).weights.rows[0]) == [1.0, 2.0, 3.0]


def test_a_controller_may_have_other_defaults_for_the_same_gains():
    gains = built(Slower, mass=5.0)
    assert (list(gains.inner.k_v), gains.most_speed) == ([2.0] * 3, 5.0)
    assert list(gains.k_i) == [2.0 / 15.0] * 3
    assert built().most_speed == 3.0


@pytest.mark.parametrize(("keys", "said"), [
    ({"k_v": 0.0}, "k_v: every entry must be greater than 0"),
    ({"k_i": -1.0}, "k_i: every entry must be zero or more"),
    ({"layer": 1.0}, "layer: should be a list"),
    ({"layer": [1.0]}, "layer[1] is required: "),
    ({"layer": [1.0, 0.0]}, "layer[1]: should be greater than 0"),
    ({"most_thrust": 1.0}, "most_thrust: unknown key; allowed here: k_i, k_v, layer, mass, most_speed, nets, type"),
    ({"nets": {"F2": 1.0}}, "nets.F2: unknown key; allowed here: F1, enabled, kappa1"),
])  # fmt: skip
def test_keys_are_checked_as_declared(keys, said):
    with pytest.raises(UserError) as refused:
        check(section_of(Sliding), {"type": "sliding", **keys}, "controller")
    assert said in str(refused.value)


def test_quadstep_new_writes_every_key_with_its_default_unit_and_meaning():
    lines = "\n".join(controller_lines(section_of(Sliding), MODEL, ["pid"]))
    assert 'type = "sliding"' in lines
    assert "sliding mode; or pid" in lines
    assert "# k_v = [0.75, 1.0, 1.25]" in lines
    assert "# 1/s; velocity" in lines
    told = tomllib.loads("\n".join(line.removeprefix("# ") for line in lines.split("\n") if " = " in line or line[:1] == "["))
    told["controller"]["nets"].pop("weights")
    assert set(told["controller"]) == set(section_of(Sliding).model_fields)
    shown = check(section_of(Sliding), told["controller"], "shown").build(Vehicle(), Path()).gains
    assert flatten(shown) == pytest.approx(flatten(built()), rel=1e-3)


def test_sliders_have_label_unit_range_and_heading():
    gains = built()
    found = {control.id: control for control in sliders(section(), gains)}
    assert list(found) == [
        "k_v", "k_i", "most_speed", "layer", "nets_start", "nets", "neurons", "F1", "kappa1", "believed_mass",
    ]  # fmt: skip
    speed, sliding, integral = found["k_v"], found["layer"], found["k_i"]
    assert (speed.label, speed.unit, speed.hint, speed.scale) == ("k_v", "1/s", "Velocity.", "log")
    assert (speed.min, speed.max, [one.label for one in speed.components]) == (0.5, 60.0, list(AXES))
    assert speed.components[2].sets[0].name == "gains.inner.k_v.2"
    assert (sliding.label, [one.label for one in sliding.components]) == ("phi", ["inner", "outer"])
    assert (integral.min, integral.low, integral.scale) == (0.0, 0.0, "linear")
    assert found["most_speed"].label == "most speed"
    assert found["believed_mass"].group == "Values assumed by the controller"
    assert set(leaf_names(gains, "gains")) >= {
        effect.name for control in found.values() for one in control.components for effect in one.sets
    }


def mission(**keys):
    content = {"vehicle": {"preset": "x500"}, "path": {"type": "step", "end": [1.0, 0.0, 1.0], "duration": 2.0}}
    return check_mission(content, "test").model_copy(update={"controller": section(**keys)})


def test_units_and_tunable_keys():
    assert label(mission(), "controller.k_v.1") == "k_v[1] [1/s]"
    assert label(mission(), "controller.nets.start") == "nets start [s]"
    assert tunable(mission(nets={"F1": 3.0})) == [
        "controller.k_v", "controller.k_i", "controller.layer", "controller.nets.start", "controller.nets.F1",
        "controller.nets.kappa1",
    ]  # fmt: skip


def test_a_warning_says_which_condition_is_broken():
    assert section().warnings(Vehicle()) == []
    assert section(k_v=[1.0, 2.0, 3.0], k_i=2.0, layer=[1.0, 1.5]).warnings(Vehicle()) == [
        "controller.k_v (x) = 1 is not above |k_i| = 2 (condition of the text)",
        "controller.k_v (y) = 2 is not above |k_i| = 2 (condition of the text)",
        "controller.layer: outer = 1.5 is below 2 inner = 2 (condition of the book)",
    ]


def candidates(count=200):
    random = np.random.default_rng(1)
    keys = ("controller.k_v.0", "controller.k_v.2", "controller.k_i.1", "controller.layer.0", "controller.layer.1")
    return [dict(zip(keys, random.uniform(0.1, 3.0, len(keys)).tolist(), strict=True)) for _ in range(count)]


def test_conditions_on_arrays_are_those_on_floats():
    base = section(k_v=1.0, k_i=1.0, layer=[1.0, 2.0])
    tried = candidates()
    columns = {key: np.array([one[key] for one in tried]) for key in tried[0]}
    together = [np.broadcast_to(one.holds, len(tried)) for one in with_gains(base, columns).conditions(MODEL)]
    alone = [[one.holds for one in with_gains(base, values).conditions(MODEL)] for values in tried]
    np.testing.assert_array_equal(np.stack(together, axis=1), alone)
    assert 0 < np.all(alone, axis=1).sum() < len(tried)


@pytest.mark.parametrize("law", ANY_LAW, ids=lambda law: f"{law.name}, {law.measures.__name__}")
def test_conditions_on_the_page_are_those_on_floats(law):
    paper = {"mass": 1.3, "inertia": [1.0, 1.5, 2.0]}
    vehicle = {Measured: {"preset": "hummingbird"}, State: paper, PlanarState: {"type": "planar"}}[law.measures]
    content = {"vehicle": vehicle, "path": {"type": "step", "end": [1.0, 0.0, 1.0], "duration": 2.0}}
    given = check_mission({**content, "controller": {"type": law.name}}, "test")
    plan, model = given.plan(), given.vehicle.model()
    controller, gains = plan.loop.controller, plan.parameters.gains
    wanted = [(one.text, one.left, one.right) for one in controller.conditions(gains, model)]
    values = dict(zip(leaf_names(plan.parameters), flatten(plan.parameters), strict=True))
    shown = page_conditions(controller, plan, model)
    assert [(one.text, value_of(one.left, values), value_of(one.right, values)) for one in shown] == wanted


def test_what_the_law_flies_may_be_worked_out_before():
    gains = built(Lqr)
    assert isinstance(gains, LqrGains)
    assert isinstance(Lqr.gains(MODEL), LqrWeights)
    assert (len(gains.level), len(gains.climb), len(gains.turn)) == (5, 3, 2)
    assert {control.id for control in sliders(section(Lqr), gains)} >= {"level", "climb", "turn", "believed_inertia"}


@pytest.mark.parametrize("written", [{}, {"controller": {"type": "geometric"}}, {"simulation": {"step": 0.001}}])
def test_a_controller_is_sampled_as_it_says_unless_the_mission_does(monkeypatch, written):
    content = {"vehicle": {"preset": "x500"}, "path": {"type": "step", "end": [1.0, 0.0, 1.0], "duration": 2.0}, **written}
    usual = check_mission(content, "test").simulation
    assert (usual.control_period, usual.guidance_period) == (Controller.rates["law"], Controller.rates["guide"])
    monkeypatch.setattr(controllers(Measured)["geometric"], "rates", {"law": 0.004, "guide": 0.02})
    own = check_mission(content, "test").simulation
    assert (own.control_period, own.guidance_period) == (0.004, 0.02)
    said = check_mission({**content, "simulation": {"control_period": 0.002}}, "test").simulation
    assert (said.control_period, said.guidance_period) == (0.002, 0.02)
    other = check_mission({**content, "controller": {"type": "pid"}}, "test").simulation
    assert other.control_period == 0.002


# The package's own


def test_every_controller_of_the_package_is_registered_under_what_it_measures():
    found = set()
    for module in iter_modules(quadstep.control.__path__):
        for one in vars(import_module(f"quadstep.control.{module.name}")).values():
            if isinstance(one, type) and issubclass(one, Controller) and one.name:
                found.add(following_rates(one))
    assert found == set(ANY_LAW)
    for kind in BUILT_IN:
        for name, law in controllers(kind).items():
            assert (law.measures, law.name) == (kind, name)


@pytest.mark.parametrize("law", ANY_LAW, ids=lambda law: f"{law.name}, {law.measures.__name__}")
def test_every_controller_says_what_it_is(law):
    model = load_preset("x500").model() if law.measures is Measured else MODEL
    assert law.label and law.source and law.__doc__
    assert hash(law.for_vehicle(model)) == hash(law.for_vehicle(model))
    for key, (_, one) in law.by_key().items():
        assert one.unit, key
        assert one.meaning, key
        low, high, _ = one.span(1.0, 2.0)
        assert low < high
    assert all(isinstance(leaf, float) for leaf in flatten(law.gains(model)))


def test_a_law_holds_structure_only():
    assert [one.name for one in fields(Backstepping)] == []


# What is refused


class Bare(NamedTuple):
    k_p: Number


class Twice(NamedTuple):
    one: Number = gain(1.0, "-", "one", key="k")
    other: Number = gain(1.0, "-", "other", key="k")


def test_declarations_that_cannot_be_are_refused():
    with pytest.raises(TypeError, match=r"Bare.k_p: declare it as gain\(...\)"):
        declared(Bare)
    with pytest.raises(TypeError, match="Twice: two gains share the key k"):
        declared(Twice)


class Taken(NamedTuple):
    build: Number = gain(1.0, "-", "taken")


def test_a_key_that_a_mission_needs_itself_is_refused():
    @dataclass(frozen=True)
    class Law(Controller):
        name = "taken"
        Gains = Taken

    with pytest.raises(TypeError, match="a gain cannot have the key build"):
        section_of(Law)


class Wrong(NamedTuple):
    k_p: Number = gain(from_gains(lambda gains, _: gains.k_q), "-", "wrong")


class Circular(NamedTuple):
    k_p: Number = gain(from_gains(lambda gains, _: gains.k_i), "-", "wrong")
    k_i: Number = gain(from_gains(lambda gains, _: gains.k_p), "-", "wrong")


def test_defaults_that_cannot_be_worked_out_say_so():
    for kind, said in ((Wrong, "Wrong has no field 'k_q'"), (Circular, "Circular.k_p: its default depends on itself")):
        with pytest.raises((AttributeError, TypeError), match=said):
            Undecided(kind, declared(kind), StatedGains({}), MODEL).decided()


def test_a_gains_slider_reaches_from_what_is_declared_or_a_decade_about_its_value():
    assert Gain(1.0, "", "", low=0.5, high=60.0).span(1.0, 2.0) == (0.5, 60.0, "log")
    assert Gain(1.0, "", "").span(1.0, 2.0) == (0.1, 20.0, "log")
    assert Gain(0.0, "", "", zero=True).span(0.0, 0.0) == (0.0, 1.0, "linear")
    assert Gain(0.0, "", "", zero=True, high=2.0).span(0.0, 0.2) == (0.0, 2.0, "linear")
    assert Gain(0.0, "", "", zero=True, high=2.0).span(0.0, 20.0) == (0.0, 200.0, "linear"), (
        "as a vehicle's own default may be"
    )
    assert Gain(1.0, "", "", low=5.0).span(1.0, 2.0) == (0.1, 20.0, "log")
    assert Gain(1.0, "", "", scale="linear").span(1.0, 2.0) == (0.0, 20.0, "linear")


def test_a_condition_that_the_page_cannot_work_out_is_left_out():
    @dataclass(frozen=True)
    class Curved(Backstepping):
        def conditions(self, gains, model):
            known = Condition("K_r1 > 0", gains.gain_1[0], 0.0, "nobody")
            return [Condition("sin K_r1 > 0", sin(gains.gain_1[0]), 0.0, "nobody"), known]

    plan = check_mission({"path": {"type": "step", "end": [1.0, 0.0, 1.0], "duration": 2.0}}, "test").plan()
    assert [one.text for one in page_conditions(Curved(), plan, MODEL)] == ["K_r1 > 0"]


@needs_node
def test_the_page_works_out_every_operation():
    """The operations of the front end's sources, on the terms that Python records."""
    text = (Path(__file__).parent.parent / "frontend" / "src" / "data" / "conditions.ts").read_text()
    table = "const OPERATIONS =" + text[text.index("const OPERATIONS") :].partition("> =")[2]
    script = (
        f"{table}; for (const [a, b, c] of [[3, 4, 5], [0, 2, 7], [-2, -2, 1]]) console.log(JSON.stringify("
        "Object.fromEntries(Object.entries(OPERATIONS).map(([name, f]) => [name, f(a, b, c)]))))"
    )
    found = [json.loads(line) for line in run_node(script).splitlines()]
    assert set(found[0]) == OPERATIONS | {"max", "min"}
    for answer, (a, b, c) in zip(found, [(3.0, 4.0, 5.0), (0.0, 2.0, 7.0), (-2.0, -2.0, 1.0)], strict=True):
        wanted = {
            "+": a + b, "-": a - b, "*": a * b, "/": a / b, "max": max(a, b), "min": min(a, b), "negative": -a,
            "magnitude": abs(a), "sqrt": a**0.5 if a >= 0 else None, "<": a < b, "<=": a <= b, ">": a > b, ">=": a >= b,
            "where": b if a else c,
        }  # fmt: skip
        assert answer == wanted


def test_a_search_takes_the_range_that_a_gain_declares():
    wide, decade = (gain_of(key, None, mission(k_v=2.0, nets={"F1": 3.0})) for key in ("controller.k_v", "controller.layer"))
    assert (wide.range.low, wide.range.high, wide.range.scale) == (0.5, 60.0, "log")
    assert (decade.range.low, decade.range.high, decade.range.scale) == (0.1, 10.0, "log")
    nets = gain_of("controller.nets.F1", None, mission(nets={"F1": 3.0}))
    assert (nets.range.low, nets.range.high, nets.range.scale) == (0.0, 30.0, "linear")
