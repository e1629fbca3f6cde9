"""Shared by the tests of tuning: short missions that can be tuned, and the content of a folder."""

import csv
import tomllib

from quadstep.studies.tuning.ground import CandidateFlyer, read_request

PAPER = """# A note that must stay.
[path]
type = "minimum-jerk"
end = [0.4, 0.1, 0.2]
duration = 0.8

[controller]   # the paper's
type = "backstepping"
K_r1 = [3.0, 3.0, 3.0] # keep
[simulation]
step = 0.004
control_period = 0.004
log_period = 0.02
[start]
position = [0.2, 0.0, 0.0]
attitude = [0.0, 0.0, 0.0]
"""
"""The paper's plant beside its path, nothing random."""

WINDY = """
[vehicle]
preset = "research-2.6kg"
[path]
type = "step"
end = [0.2, 0.0, 0.3]
time = 0.1
duration = 1.2
[controller]
type = "geometric"
k_x = [3.0, 3.0, 3.0]
k_v = [1.0, 1.0, 1.0]
[wind]
mean = [4.0, 0.0, 0.0]
turbulence = { wind_20 = 8.0, height = 6.0 }
[sensors]
position_noise = 0.005
gyro_noise = 0.01
"""
"""A real vehicle, far too soft, whose flights differ by their noise."""

LAMBDA = "[tune]\nconstraints = {}\n[tune.gains]\ncontroller.Lambda1 = { low = 0.3, high = 30.0 }\n"
SOFT = """
[tune]
constraints = {}
seeds = 8
unseen = 32
[tune.gains]
controller.k_x = { low = 2.0, high = 60.0 }
controller.k_v = { low = 1.0, high = 20.0 }
[tune.vary]
vehicle.mass = { type = "uniform", low = 2.4, high = 3.0 }
"""


def written(folder, text, name="mission.toml"):
    """A mission's file."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def ground(folder, text, seed=1):
    """The proving ground of a mission."""
    return CandidateFlyer(read_request(written(folder, text)), seed)


def history(folder):
    """The rows of history.csv."""
    with (folder / "history.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def tuned(folder):
    """tuned.toml as parsed."""
    return tomllib.loads((folder / "tuned.toml").read_text(encoding="utf-8"))


def lasting(folder):
    """What is in a folder, half-written things too."""
    return sorted(path.name for path in folder.rglob("*")) if folder.exists() else []
