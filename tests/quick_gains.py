"""Gains of quicker loops than the defaults: with margins too small to be graded sound, and numbers found by other programs."""

POSITION = {"k_x": 24.0, "k_v": 3.8, "k_i": 20.0}
QUICK = {
    "geometric": {**POSITION, "k_R": [270.0, 270.0, 70.0], "k_Omega": [35.0, 35.0, 17.0]},
    "pid": {"position": 5.0, "velocity": 6.2, "velocity_integral": 5.2, "attitude": [12.3, 12.3, 6.2],
        "rate": [40.0, 40.0, 20.0], "rate_integral": [25.0, 25.0, 10.0]},
    "lqr": {"level": [40.0, 40.0, 4.0, 1.0, 0.3, 0.002], "climb": [20.0, 40.0, 4.0, 1.0], "turn": [40.0, 4.0, 0.4]},
    "rotation-backstepping": {"Lambda1": 1.2, "K_r1": 7.0, "K_i1": 7.0 / 15.0, "Lambda2": [4.7, 4.7, 2.4],
        "K_r2": [28.0, 28.0, 14.0], "K_i2": [80.0, 80.0, 40.0], "P": 60.0, "filter_frequency": [31.0, 31.0, 15.5]},
}  # fmt: skip
