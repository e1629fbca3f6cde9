"""What `quadstep fly` makes of a circle that an export flew under PX4, with EKF2's velocity as the flight's log has it."""

import re
import tomllib
from pathlib import Path

import numpy as np

from quadstep import Mission, fly
from quadstep.identify.logs.read import read_topics
from tests.firmware_switch import told

SETTLED, WITHIN = 10.0, 0.1
"""From when on errors of `fly` count [s]; how far its RMSE may be from the flight's, as a share."""

ROOT = Path(__file__).parent.parent


def velocity_of(log: Path) -> tuple[float, float]:
    """By how much the estimated velocity is late against the estimated position [s], and its size over the true one's, by the
    first harmonics of the last 10 s of the first circle of 2 m in 10 s.
    """
    names = [f"vehicle_local_position.{one}" for one in ("x", "y", "vx", "vy")]
    columns = read_topics(log, names).columns
    time = columns[names[0]].time
    x, y, vx, vy = (columns[name].value for name in names)
    full = 0.4 * np.pi
    quick = np.abs(np.hypot(vx, vy) - full) < 0.1
    ends = np.flatnonzero(quick[:-1] & ~quick[1:])
    last = next(end for end in ends if quick[(time > time[end] - 14.0) & (time <= time[end])].all())
    kept = (time > time[last] - 10.2) & (time <= time[last] - 0.2)
    turn = 0.2 * np.pi
    terms = np.stack([np.ones(kept.sum()), *(np.exp(sign * 1j * turn * time[kept]) for sign in (1.0, -1.0))], axis=1)
    position, velocity = (np.linalg.lstsq(terms, z[kept], rcond=None)[0][1:] for z in (x + 1j * y, vx + 1j * vy))
    way = int(np.argmax(np.abs(position)))
    speed = velocity[way] / ((1j, -1j)[way] * turn * position[way])
    return float((-1.0, 1.0)[way] * np.angle(speed) / turn), float(np.abs(speed))


def circle(folder: Path, late: float, size: float) -> float:
    """The RMSE [mm] of `fly` on the same circle, in the wind of a flight's folder, with such a velocity."""
    flown = tomllib.loads((folder / "mission.toml").read_text(encoding="utf-8"))
    estimator = {"type": f"{ROOT / 'examples/sensing.py'}:LateVelocity", "late": max(late, 0.0), "size": size}
    told = Mission(
        vehicle=flown["vehicle"],
        path={"type": "circle", "centre": [0.0, 0.0, 10.0], "radius": 2.0, "period": 10.0},
        controller={"type": "pid"},
        simulation={"duration": 20.0, "step": 0.0005, "control_period": 0.004},
        sensors={"estimator": estimator},
        **({"wind": flown["wind"]} if "wind" in flown else {}),
    )
    flight = fly(told)
    kept = flight.column("t") >= SETTLED
    away = [flight.column(axis)[kept] - flight.column(f"{axis}_d")[kept] for axis in "xyz"]
    return 1e3 * float(np.sqrt(sum(np.mean(np.square(one)) for one in away)))


def told_of_px4(rows: np.ndarray, text: str, folder: Path) -> str:
    """What was said in flight, and beside the circle's RMSE that of `fly`. Fails where they are more than WITHIN apart."""
    said = told(rows, text, folder)
    found = re.search(r"circle: rmse ([\d.]+) mm", said)
    if not found or "effects" in (folder / "mission.toml").read_text(encoding="utf-8"):
        return said
    late, size = velocity_of(max(folder.rglob("*.ulg")))
    ours = circle(folder, late, size)
    assert abs(float(found[1]) / ours - 1.0) < WITHIN, f"the circle of fly with EKF2's velocity {ours:.1f} mm; {said}"
    return (
        f"circle of fly with a velocity {1e3 * late:.1f} ms late and {100.0 * (1.0 - size):.2f} % small {ours:.1f} mm; {said}"
    )
