"""What the theory asks of the gains, as the page's badge evaluates it."""

from typing import Any

from quadstep.mission.controllers import BacksteppingSection, CompletedSection, NestedSaturationSection
from quadstep.page.controls import ANGLES, AXES
from quadstep.page.model import Condition

THEOREM = "Theorem 5.1, corrected"


def term(op: str, *of: Any) -> dict[str, Any]:
    """An operation of a condition."""
    return {"op": op, "of": list(of)}


def named(name: str) -> dict[str, Any]:
    """A parameter in a condition."""
    return {"name": name}


def entries(name: str, count: int = 3) -> list[dict[str, Any]]:
    """A vector of parameters in a condition."""
    return [named(f"{name}.{place}") for place in range(count)]


def conditions(section: Any) -> list[Condition]:
    """What the theory asks of the gains of a controller that a mission can name; nothing of one that it does not know."""
    if isinstance(section, NestedSaturationSection):
        return nested_conditions()
    if not isinstance(section, BacksteppingSection):
        return []
    at = "gains.paper" if isinstance(section, CompletedSection) else "gains"
    found = theorem_conditions(at)
    return found if isinstance(section, CompletedSection) else [*found, coupling_condition(at)]


def nested_conditions() -> list[Condition]:
    """Each saturation at least twice as wide as the one inside it."""
    b = entries("gains.bounds", 4)
    return [Condition(f"b_{i + 1} >= 2 b_{i + 2}", b[i], term("*", 2, b[i + 1]), True, "reference [11]") for i in range(3)]


def outer_bounds(at: str, vehicle: str) -> list[dict[str, Any]]:
    """m Lambda_1."""
    return [term("*", named(f"{vehicle}.mass"), slope) for slope in entries(f"{at}.slope_1")]


def inner_bound(at: str, vehicle: str) -> dict[str, Any]:
    """J_M max(Lambda_2) with J_M = 2 max(Sigma), which bounds J at every attitude."""
    return term("*", 2, term("max", *entries(f"{vehicle}.inertia")), term("max", *entries(f"{at}.slope_2")))


def theorem_conditions(at: str, vehicle: str = "vehicle") -> list[Condition]:
    """Those of Theorem 5.1, with the second one corrected. at, vehicle: where gains and vehicle are in the parameters."""
    outer = zip(AXES, entries(f"{at}.gain_1"), outer_bounds(at, vehicle), strict=True)
    inner = zip(ANGLES, entries(f"{at}.gain_2"), strict=True)
    return [
        *(Condition(f"K_r1 ({axis}) > m Lambda1", gain, bound, False, THEOREM) for axis, gain, bound in outer),
        *(
            Condition(f"K_r2 ({angle}) > J_M max(Lambda2)", gain, inner_bound(at, vehicle), False, THEOREM)
            for angle, gain in inner
        ),
    ]


def rotation_conditions() -> list[Condition]:
    """What is left of them on the rotation group, where the rigid-body torque is fed forward; gains over mass."""
    pairs = zip(AXES, entries("gains.gain_1"), entries("gains.slope_1"), strict=True)
    return [Condition(f"K_r1 ({axis}) > Lambda1", gain, slope, False, THEOREM) for axis, gain, slope in pairs]


def coupling_condition(at: str, vehicle: str = "vehicle") -> Condition:
    """u < 2 l_2 sqrt(k_1 k_2), squared, for the thrust of hovering: what the printed proof leaves out."""
    k_1 = [term("-", gain, bound) for gain, bound in zip(entries(f"{at}.gain_1"), outer_bounds(at, vehicle), strict=True)]
    k_2 = [term("-", gain, inner_bound(at, vehicle)) for gain in entries(f"{at}.gain_2")]
    l_2, hover = term("min", *entries(f"{at}.slope_2")), term("*", named(f"{vehicle}.mass"), named(f"{vehicle}.gravity"))
    room = term("*", 4, l_2, l_2, term("max", 0, term("min", *k_1)), term("max", 0, term("min", *k_2)))
    text = "(m g)^2 < 4 l_2^2 k_1 k_2: the coupling of both loops, at hover"
    return Condition(text, room, term("*", hover, hover), False, "Theorem A of docs/theory.md")
