"""A controller that is any function (docs/own.md)."""


def controller(t, measured, reference):  # noqa: ARG001 (what it is told)
    """Thrust and torque, upright and far too simple to hold a path."""
    climb = 4.0 * (reference.position[2] - measured.position[2]) - 3.0 * measured.velocity[2]
    return 2.6 * (9.81 + climb), (0.0, 0.0, 0.0)
