"""Sliders for gains of which nothing is known but their names and values."""

import math
from typing import Any

from quadstep.numbers import flatten, in_matrix, leaf_names
from quadstep.page.controls import AXES, BELIEF, GAINS, control, parameter, positive
from quadstep.page.model import Component, Control

MOST_SLIDERS = 60

SYMBOLS = {
    "slope_1": "Lambda1",
    "gain_1": "K_r1",
    "integral_1": "K_i1",
    "slope_2": "Lambda2",
    "gain_2": "K_r2",
    "integral_2": "K_i2",
    "coupling": "P",
    "stiffness": "k_x",
    "damping": "k_v",
    "integral": "k_i",
    "turn_stiffness": "k_R",
    "turn_damping": "k_Omega",
}
"""The literature's symbols for gains, by their names in the code."""


def plain_controls(gains: Any) -> list[Control]:
    """A slider for every number or vector of gains, matrices and nets left out, if they are not too many."""
    vectors: dict[str, list[Component]] = {}
    for name, leaf, entry in zip(leaf_names(gains), flatten(gains), in_matrix(gains), strict=True):
        if (
            entry
            or "_net." in name
            or name == "learning_start"
            or not isinstance(leaf, float | int)
            or not math.isfinite(leaf)
        ):
            continue
        head, _, tail = name.rpartition(".")
        whole, label = (head, AXES[int(tail)] if int(tail) < len(AXES) else tail) if head and tail.isdigit() else (name, "")
        vectors.setdefault(whole, []).append(Component(label, float(leaf), (parameter(f"gains.{name}"),)))
    if len(vectors) > MOST_SLIDERS:
        return []
    return [plain_control(name, components) for name, components in vectors.items()]


def plain_control(name: str, components: list[Component]) -> Control:
    """The slider of one gain."""
    belief = name in ("mass", "inertia", "gravity")
    label = SYMBOLS.get(name, name.replace("_", " "))
    place = f"believed_{name}" if belief else name
    above = min(component.value for component in components) > 0.0
    made = positive(place, label, "", components) if above else control(place, label, "", components, (-10.0, 10.0))
    return made._replace(group=BELIEF if belief else GAINS)
