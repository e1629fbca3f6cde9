"""Certificates: what `prove --check` confirms of tampered ones is flown, and where `certify` says that L fell, it did."""

import copy
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from quadstep.io.documents import parse_toml
from quadstep.io.errors import UserError
from quadstep.mission.read import check_mission, plan_mission
from quadstep.proofs.certify.certificate import certify_plan
from quadstep.proofs.certify.standing import kind
from quadstep.proofs.prove.certificate_file import read_unknown
from quadstep.proofs.prove.report import VerdictKind
from quadstep.proofs.prove.run import check
from quadstep.proofs.prove.sampled import SampledLoop
from tests.certificates import still
from tests.challenge.search import Attempt, Search
from tests.planar_proofs import SET, TUBE, forged, proved
from tests.started import begun, flown

Content = dict[str, Any]
Change = Callable[[np.random.Generator, Content], str]

VALUES = (
    0.0, -0.0, -1.0, 1e-320, -1e-320, 5e-324, 1e-310, 1e-200, 1e-99, 1e99, 1e200, 1.7e308, -1.7e308, float("nan"),
    float("inf"),
)  # fmt: skip
FACTORS = (-1.0, 0.0, 0.5, 0.9, 0.99, 1.01, 1.1, 2.0, 1e3, 1e-3, 1e60, 1e-60)


def places(content: object, way: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    """The ways to all numbers of a certificate."""
    if isinstance(content, dict | list):
        items = content.items() if isinstance(content, dict) else enumerate(content)
        return [one for key, inner in items for one in places(inner, (*way, key))]
    return [way] if isinstance(content, float | int) else []


def holder(content: Any, way: tuple[str | int, ...]) -> tuple[Any, str | int]:
    for key in way[:-1]:
        content = content[key]
    return content, way[-1]


def any_number(random: np.random.Generator, content: Content) -> str:
    known = places(content)
    way = known[int(random.integers(len(known)))]
    inner, last = holder(content, way)
    old = inner[last]
    inner[last] = random.choice(VALUES) if random.random() < 0.5 else float(old) * random.choice(FACTORS)
    return f"{way}: {old} -> {inner[last]}"


def a_swap(random: np.random.Generator, content: Content) -> str:
    key = str(random.choice([name for name, one in content.items() if isinstance(one, list) and len(one) > 1]))
    i, j = random.choice(len(content[key]), 2, replace=False)
    content[key][i], content[key][j] = content[key][j], content[key][i]
    return f"{key}: {i} and {j} change places"


def a_claim(random: np.random.Generator, content: Content) -> str:
    """More than was proved, in one way."""
    factor = float(random.choice([1.0001, 1.01, 1.1, 2.0, 100.0]))
    key = str(
        random.choice([*content["unknown"], "position[m]", *(["start[m]", "radii"] if "radii" in content else ["boxes"])])
    )
    if key in content["unknown"]:
        content["unknown"][key] = max(content["unknown"][key], 1e-3 * random.random()) * factor
    elif key == "start[m]":
        content[key] *= factor
    else:
        content[key] = (np.array(content[key]) / factor).tolist()
    return f"{key} by {factor}"


def coordinates(random: np.random.Generator, content: Content) -> str:
    """Other coordinates with boxes that go with them or not."""
    spread, sizes = np.array(content["spread"]), np.array(content["radii" if "radii" in content else "boxes"])
    place, factor = int(random.integers(len(spread))), float(random.choice([1e3, 1e60, 1e99, 1e200, 1e307, -1.0]))
    if random.random() < 0.5:
        spread[:, place] *= factor
    else:
        spread[place, int(random.integers(len(spread)))] = factor
    if random.random() < 0.7:
        sizes[..., place] /= abs(factor)
    content["spread"], content["radii" if "radii" in content else "boxes"] = spread.tolist(), sizes.tolist()
    content["position[m]"] = (np.array(content["position[m]"]) * float(random.choice([1e-12, 0.5, 1.0]))).tolist()
    return f"coordinate {place} by {factor}"


def overflow(random: np.random.Generator, content: Content) -> str:
    """Numbers whose products or inverses are none, with a claim that could only pass by a comparison with NaN."""
    count, size = len(content["spread"]), float(random.choice([1e-310, 1e-200, 1e-90, 1e60, 1e99, 1e200, 1.7e308]))
    if "radii" in content:
        content["spread"], content["radii"], content["start[m]"] = (size * np.eye(count)).tolist(), [1e-3] * count, 0.5
    else:
        row, column = sorted(random.choice(np.arange(2, count), 2, replace=False), reverse=True)
        content["spread"][row][column] = size
        for box in content["boxes"]:
            box[column] = 1e-10 / size
    content["position[m]"] = [1e-15] * len(content["position[m]"])
    return f"coordinates of {size}, and nothing claimed to move"


def negative(random: np.random.Generator, content: Content) -> str:
    """A start that takes away from the bounds."""
    size = float(10.0 ** random.uniform(-6.0, -2.0))
    content["start[m]" if "radii" in content else "unknown"] = (
        -size if "radii" in content else {**content["unknown"], "start[m]": -size}
    )
    content["position[m]"] = (np.array(content["position[m]"]) * 1e-3).tolist()
    return f"a start of -{size}"


def words(random: np.random.Generator, content: Content) -> str:
    """Another mission, other names, other pairs."""
    some = [("planar-pd", 'planar-pd"\nk_p = 9.0 #'), ("5.0", "5.1"), ("0.2", "0.1"), ("0.002", "0.004")]
    kind = int(random.integers(3))
    if kind == 0:
        old, new = some[int(random.integers(len(some)))]
        content["mission"] = content["mission"].replace(old, new)
        return f"mission: {old} -> {new}"
    if kind == 1:
        i, j = random.choice(len(content["states"]), 2, replace=False)
        content["states"][i], content["states"][j] = content["states"][j], content["states"][i]
        return f"states {i} and {j} change places"
    if "pairs" in content:
        content["pairs"] = [] if random.random() < 0.5 else [0]
        content["own_start"] = bool(random.random() < 0.5)
    else:
        content["samples_per_block"] = int(random.integers(-1, 200))
    return "pairs or blocks"


CHANGES: tuple[Change, ...] = (any_number, any_number, a_swap, a_claim, coordinates, overflow, negative, words)


def broken(content: Content, folder: Path) -> float:
    """How far flights get towards breaking a claim that was confirmed: the largest share of the claimed bounds."""
    mission = check_mission(parse_toml(content["mission"], "mission"), "mission", folder)
    loop = SampledLoop(plan_mission(mission, folder / "mission.toml", folder))
    unknown, claim = read_unknown(content["unknown"]), np.array(content["position[m]"])
    samples, centre = min(loop.samples, 100), flown(loop, loop.at_rest(loop.like), min(loop.samples, 100))
    if "radii" in content:
        unknown, centre = unknown._replace(start=content["start[m]"]), np.array([content["rest"]])
    most = 0.0
    for way in ([1, 1], [1, -1], [-1, 1], [-1, -1]):
        shares = np.outer([1, 1, -1, -1], [*way, 1.0])
        rows = flown(loop, begun(loop, unknown, shares), samples)[1 if "radii" in content else 0 :]
        most = max(most, float((np.abs(rows - centre)[:, : len(claim)] / np.maximum(claim, 1e-300)).max()))
    return most


def tampered(seed: int) -> Iterable[Attempt]:
    random = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        bases = [
            proved(folder, TUBE, "--start", "0.001"),
            proved(folder, SET),
            proved(folder, SET, "--start-velocity", "0.001"),
        ]
        while True:
            content = copy.deepcopy(bases[int(random.integers(len(bases)))])
            said = [CHANGES[int(random.integers(len(CHANGES)))](random, content) for _ in range(int(random.integers(1, 3)))]
            file = folder / "tampered.json"
            file.write_bytes(forged(content))
            try:
                with np.errstate(all="ignore"):
                    confirmed = check(file).kind is VerdictKind.PROVED
            except UserError:
                confirmed = False
            yield Attempt(broken(content, folder) if confirmed else 0.0, "; ".join(said))


def falling(seed: int) -> Iterable[Attempt]:
    """|r| outside the ball, without nets: L is m |r1|^2 / 2 + r2^T J r2 / 2 and the integrals, and must not rise."""
    random = np.random.default_rng(seed)
    while True:
        period, gain = 0.002 * int(random.integers(1, 60)), float(random.uniform(20.0, 160.0))
        slope, yaw = float(random.uniform(0.3, 1.2)), float(random.uniform(-2.0, 2.0))
        times = {"duration": 3.0, "step": 0.002, "control_period": period}
        law, start = {"K_r2": gain, "Lambda2": slope}, {"attitude": [yaw, 0.0, 0.0]}
        try:
            c = certify_plan(still(law, start=start, simulation=times))
        except UserError:
            continue
        level = c.lyapunov.of_errors + c.lyapunov.of_integrals
        rose = bool((np.diff(level)[c.outside[:-1] & c.outside[1:]] >= 0.0).any())
        case = f"control period {period:g} s, K_r2 {gain:.3g}, Lambda2 {slope:.3g}, yaw {yaw:.3g}: {kind(c)}"
        yield Attempt(2.0 * (kind(c) == "sign consistent" and rose), case)


SEARCHES = [
    Search("tampered certificates", "a claim that the independent check confirms holds for every flight", tampered),
    Search("L fell where it should", "a flight that agrees with Theorem 5.1 never raises L outside the ball", falling),
]
