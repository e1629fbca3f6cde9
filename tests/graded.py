"""Flights, and the rules of `quadstep.metrics.verdict` that each of them breaks."""

X500 = {"preset": "x500"}
CIRCLE = {"type": "circle", "centre": [0.0, 0.0, 4.0], "radius": 3.0, "period": 9.0, "ramp": 1.0}
HOVER = {"type": "step", "start": [0.0, 0.0, 4.0], "end": [0.0, 0.0, 4.0], "duration": 4.0}
CASE_1 = {"type": "minimum-jerk", "end": [20.0, 5.0, 10.0], "duration": 40.0}

FLIGHTS = {
    "a circle": ({"vehicle": X500, "path": CIRCLE}, []),
    "a hover": ({"vehicle": X500, "path": HOVER}, []),
    "around a small circle, far from the start": (
        {"vehicle": X500, "path": {**CIRCLE, "radius": 0.1}, "start": {"position": [20.0, 0.0, 4.0]}, "score_from": 17.0,
         "wind": {"mean": [6.0, 0.0, 0.0]}, "simulation": {"duration": 20.0},
         "controller": {"type": "pid", "velocity_integral": 0.0}},
        ["relative_error"],
    ),
    "a step that a plant without arms does not follow": (
        {"vehicle": {"type": "planar"}, "path": {**HOVER, "start": [0.5, 0.0, 4.0]},
         "controller": {"type": "planar-pd", "k_p": 0.05}},
        ["relative_error"],
    ),
    "a step": ({"path": {"type": "step", "end": [0.0, 0.0, 1.0], "duration": 8.0}}, []),
    "a circle too fast": (
        {"vehicle": X500, "path": {**CIRCLE, "period": 1.5}, "simulation": {"duration": 4.0}},
        ["relative_error", "heading_error[rad]", "saturated_share"],
    ),
    "blown off a hover": (
        {"vehicle": {"preset": "crazyflie"}, "path": HOVER, "wind": {"mean": [10.0, 0.0, 0.0]}},
        ["relative_error"],
    ),
    "blown off a long path": (
        {"vehicle": X500,
         "path": {"type": "minimum-jerk", "start": [0.0, 0.0, 50.0], "end": [200.0, 0.0, 50.0], "duration": 20.0},
         "wind": {"mean": [0.0, 10.0, 0.0]}, "controller": {"type": "pid", "velocity_integral": 0.0, "position": 0.3}},
        ["relative_error"],
    ),
    "a late step": ({"vehicle": X500, "path": {**HOVER, "end": [0.5, 0.0, 4.0], "time": 4.3, "duration": 5.0}}, []),
    "a rotor lost at the last moment": (
        {"vehicle": X500, "path": CIRCLE, "simulation": {"duration": 9.0},
         "events": [{"type": "rotor", "time": 8.9, "rotor": 1, "efficiency": 0.0}]},
        ["rate_growth"],
    ),
    "a rotor lost at the last moment, long after a step": (
        {"vehicle": X500, "path": {**HOVER, "end": [1.0, 0.0, 4.0]}, "simulation": {"duration": 10.0},
         "events": [{"type": "rotor", "time": 9.75, "rotor": 1, "efficiency": 0.0}]},
        ["rate_growth"],
    ),
    "blown away at the last moment, long after a step": (
        {"vehicle": X500, "path": {**HOVER, "end": [1.0, 0.0, 4.0]}, "simulation": {"duration": 10.0},
         "wind": {"gust": {"velocity": [30.0, 0.0, 0.0], "start": 9.3, "length": 0.7}}},
        ["error_growth"],
    ),
    "a nose that does not turn": (
        {"vehicle": X500, "path": {**CIRCLE, "yaw_rate": 0.6},
         "controller": {"type": "pid", "rate": [20.0, 20.0, 0.01], "rate_integral": 0.0}},
        ["heading_error[rad]", "shaking[rad]"],
    ),
    "over at once": (
        {"path": {**CASE_1, "duration": 0.5}, "simulation": {"duration": 0.5}},
        ["relative_error", "overturned[rad]", "error_growth"],
    ),
    "on its path, and shaking by 20 degrees": (
        {"path": {**CASE_1, "duration": 3.0}, "controller": {"type": "completed-backstepping"},
         "simulation": {"duration": 8.0}},
        ["shaking[rad]"],
    ),
    "a slowly growing oscillation": (
        {"path": CASE_1, "controller": {"type": "backstepping", "K_r1": 1.2}},
        ["error_growth", "rate_growth"],
    ),
}  # fmt: skip
