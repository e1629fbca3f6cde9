"""Controllers: the paper's adaptive neural backstepping (Eqs 11-54), its reference [11], and laws for real vehicles.

Laws over numbers that know neither files nor engines; rooms above may import it, `sensing` excepted.

Your own controller is a law over numbers (`controller.py`; `examples/own_controller.py` is one), or any callable
(`control/opaque.py`). Its input is a `Measured`, or on the paper's plant a `State` of Euler angles, and its output a
`Command`: thrust [N] and torque [N m].

>>> from quadstep.control import Command, invert_force
>>> from quadstep.numbers import vector
>>> thrust, theta_d, phi_d = invert_force(vector(0.0, 0.0, 9.81))  # the desired force [N], inertial, z up: hover
>>> command = Command(thrust, torque=vector(0.0, 0.0, 0.0), desired_attitude=vector(0.0, theta_d, phi_d))
>>> command.thrust, command.desired_attitude
(9.81, Vector([0.0, 0.0, 0.0]))

Give a plan another controller and fly it:

>>> from quadstep import Mission, fly
>>> from quadstep.control import flying
>>> hover = {"type": "step", "start": [0.0, 0.0, 1.0], "end": [0.0, 0.0, 1.0], "time": 0.1, "duration": 0.2}
>>> plan = Mission(vehicle={"preset": "x500"}, path=hover, simulation={"duration": 0.2}).plan()
>>> with flying(lambda t, measured, reference: (20.0, [0.0, 0.0, 0.0])) as (law, gains):
...     flight = fly(plan.with_controller(law, gains))
>>> float(flight.column("u").max())
20.0
"""

from quadstep.control.opaque import flying
from quadstep.control.vectoring import invert_force
from quadstep.interfaces.controller import Command, Measured

__all__ = ["Command", "Measured", "flying", "invert_force"]
