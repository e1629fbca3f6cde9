"""Battery sag: the terminal voltage under the rotors' load."""

from typing import NamedTuple

from quadstep.numbers import Number, Vector, maximum, sqrt, total


class Battery(NamedTuple):
    """full, empty: open-circuit voltage at either end [V]. capacity [C]. resistance [Ohm]. efficiency: motors and ESCs [-]."""

    full: Number
    empty: Number
    capacity: Number
    resistance: Number
    efficiency: Number


def electrical_power(battery: Battery, torque: Number, speeds: Vector) -> Number:
    """Power of the rotors [W]: sum of k_m w^3 over the efficiency, also with a fault. torque: k_m [N m s^2]; speeds
    [rad/s].
    """
    return (torque / battery.efficiency) * total((speed * speed) * speed for speed in speeds)


def open_circuit(battery: Battery, charge: Number) -> Number:
    """Open-circuit voltage after drawing `charge` [C], falling linearly from full to empty [V].

    Past empty it keeps falling, to a tenth of `empty`.
    """
    slope = (battery.empty - battery.full) / battery.capacity
    return maximum(battery.full + slope * charge, 0.1 * battery.empty)


def terminal_voltage(battery: Battery, charge: Number, power: Number) -> Number:
    """Voltage V under a load of `power` [W]: the larger root of V^2 - V_oc V + R P = 0 [V].

    A battery cannot supply more than V_oc^2 / (4 R); for a larger load its voltage is V_oc / 2.
    """
    open_voltage = open_circuit(battery, charge)
    return 0.5 * (open_voltage + sqrt(maximum(open_voltage * open_voltage - 4.0 * battery.resistance * power, 0.0)))
