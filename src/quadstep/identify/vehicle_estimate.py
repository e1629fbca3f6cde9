"""A vehicle from its data sheet: each number measured, estimated by a formula, or taken as usual, and how sure it is.

Formulas: thrust T = C_T rho n^2 D^4 and power P = C_P rho n^3 D^5 of a propeller (n in revolutions a second; McCormick,
"Aerodynamics, Aeronautics, and Flight Mechanics", 1995, 6.4); typical C_T and C_P near hover as in the propeller data of the
University of Illinois (Brandt and Selig 2011: C_T 0.08 to 0.15, C_P 0.03 to 0.07 for pitch over diameter 0.4 to 0.8). Torque
of a motor Q = K_t (I - I_0), K_t = 60 / (2 pi kV).
"""

import math
from functools import partial
from typing import NamedTuple

import numpy as np

from quadstep.identify.datasheet import Datasheet, StandSection
from quadstep.identify.logs.flight import Floats
from quadstep.io.errors import UserError
from quadstep.mission.airframe import LAYOUTS, AirframeSection, laid_out

AIR = 1.225
C_T, C_T_SPREAD = 0.11, 0.35
C_P, C_P_SPREAD = 0.045, 0.3
LOADED, LOADED_SPREAD = 0.8, 0.1
"""Share of the speed kV V that a loaded motor reaches at full throttle."""

PROPELLER, GYRATION = 0.16, 0.2
"""Mass of a propeller over its diameter squared [kg/m^2], and its radius of gyration over its diameter: together 0.0064 D^4
and with the bell 0.86 to 1.48 of five published inertias (tests/test_datasheet.py). A uniform rod has 0.29 D.
"""

MOTORS = 0.4
"""Share of a vehicle's mass at the ends of its arms: motors, and as much again of arms and wires."""

BELL = 7e-4
"""Inertia of a motor's bell over its mass to the power 5/3: half the mass on 0.85 of the radius, and a 33 g motor is 28 mm
across [kg^(-2/3) m^2].
"""

FULL, EMPTY = 4.2, 3.5
"""Volts of a lithium polymer cell."""

RPM = math.pi / 30.0


class Number(NamedTuple):
    """A number of the vehicle: where it is from, and the standard deviation of its logarithm."""

    value: float
    source: str
    spread: float


def number_from(kind: str, value: float, what: str, spread: float) -> Number:
    return Number(value, f"{kind}: {what}, {share(spread)}", spread)


measured, estimated, usual = (partial(number_from, kind) for kind in ("measured", "estimated", "usual"))


def share(spread: float) -> str:
    """How sure a number is, in words: one standard deviation."""
    return f"±{100 * spread:.2g} %"


def through_origin(x: Floats, y: Floats) -> tuple[float, float]:
    """y = slope x by least squares, and the standard error of the slope over it, at least half a per cent."""
    slope = float(x @ y / (x @ x))
    rest = y - slope * x
    error = math.sqrt(float(rest @ rest) / max(len(x) - 1, 1) / float(x @ x))
    return slope, max(error / abs(slope), 5e-3)


class VehicleEstimate(NamedTuple):
    thrust: Number
    torque: Number
    fastest: Number
    exponent: Number
    voltage_exponent: Number
    nominal: float
    rotor_inertia: Number
    rise: Number
    inertia: tuple[Number, Number, Number]
    disc_drag: Number
    axial_drag: Number
    parasitic: Number
    capacity: Number
    resistance: Number
    efficiency: Number


def estimate(sheet: Datasheet) -> VehicleEstimate:
    """Every number of a vehicle. Raises UserError where a thrust stand contradicts itself."""
    count = LAYOUTS[sheet.layout][0]
    diameter, full = sheet.propeller.size, FULL * sheet.cells
    by_formula = C_T * AIR * diameter**4 / (4.0 * math.pi**2)
    stand = sheet.stand
    running = on_stand(stand) if stand else None
    nominal = float(np.mean(running["voltage"])) if running and "voltage" in running else full
    if running and "speed" in running:
        thrust, spread = through_origin(running["speed"] ** 2, running["thrust"])
        k_f = measured(thrust, "thrust stand, thrust over speed squared", spread)
        speeds = running["speed"]
    else:
        k_f = estimated(by_formula, f"C_T = {C_T} at D = {diameter:.3g} m", C_T_SPREAD)
        if running:
            k_f = with_kv(k_f, sheet, running, full)
        speeds = np.sqrt(running["thrust"] / k_f.value) if running else np.zeros(0)
    k_m = torque_of(sheet, running, speeds, k_f)
    if running:
        exponent, voltage_exponent, at_full = curve(running, speeds, nominal)
        rise = (full / nominal) ** voltage_exponent.value
        how = "thrust stand, extrapolated to full throttle and a full battery"
        fastest = measured(at_full * rise, how, max(0.03, 0.5 * k_f.spread))
    else:
        nominal = full
        exponent = usual(1.0, "speed in proportion to throttle", 0.15)
        voltage_exponent = usual(1.0, "speed in proportion to voltage", 0.15)
        fastest = estimated(
            LOADED * sheet.kv * RPM * full, f"{LOADED} of kV times the full voltage, under load", LOADED_SPREAD
        )
    most = count * k_f.value * fastest.value**2 / (9.81 * sheet.mass)
    if most < 1.05:
        raise UserError(
            f"the rotors lift {most:.2f} times the weight at full throttle; are mass, kv, propeller and stand correct?"
        )
    spin = rotor_inertia(sheet, count)
    hover = math.sqrt(sheet.mass * 9.81 / (count * k_f.value))
    if sheet.rise_time:
        rise_time = measured(sheet.rise_time, "data sheet", 0.1)
    else:
        rise_time = usual(0.025 + 0.1 * diameter, "25 ms and 0.1 s a metre of propeller", 0.4)
    disc = 0.3 * sheet.mass / (count * hover)
    capacity = sheet.capacity or 0.02 * sheet.mass * 100.0
    return VehicleEstimate(
        thrust=k_f,
        torque=k_m,
        fastest=fastest,
        exponent=exponent,
        voltage_exponent=voltage_exponent,
        nominal=nominal,
        rotor_inertia=spin,
        rise=rise_time,
        inertia=body_inertia(sheet, count),
        disc_drag=usual(disc, "0.3 /s at hover", 0.5),
        axial_drag=usual(disc, "as in the disc", 0.7),
        parasitic=usual(0.5 * AIR * (0.35 * sheet.wheelbase) ** 2, "C_D = 1 on a square of 0.35 wheelbase", 0.6),
        capacity=(
            measured(3600.0 * capacity, "data sheet", 0.05)
            if sheet.capacity
            else usual(3600.0 * capacity, "2 Ah a kilogram", 0.5)
        ),
        resistance=usual(sheet.cells * 0.012 / capacity, "12 mOhm Ah a cell", 0.5),
        efficiency=efficiency_of(running, speeds, k_m),
    )


def rotor_inertia(sheet: Datasheet, count: int) -> Number:
    """Inertia of propeller and motor bell about the axis."""
    diameter = sheet.propeller.size
    mass = sheet.propeller.mass or PROPELLER * diameter**2
    motor = sheet.motor_mass or 0.5 * MOTORS * sheet.mass / count
    bell = BELL * motor ** (5.0 / 3.0)
    how = f"propeller of {1e3 * mass:.2g} g, thinner to its tips, and the motor's bell"
    return estimated(mass * (GYRATION * diameter) ** 2 + bell, how, 0.4)


def with_kv(k_f: Number, sheet: Datasheet, running: dict[str, Floats], full: float) -> Number:
    """k_f by the propeller's formula and by the speed that kV allows at the most thrust of a stand; the surer counts more."""
    top = int(np.argmax(running["thrust"]))
    volts = float(running["voltage"][top]) if "voltage" in running else full
    speed = LOADED * sheet.kv * RPM * volts * float(running["throttle"][top])
    other, spread = float(running["thrust"][top]) / speed**2, 2.0 * LOADED_SPREAD
    weights = 1.0 / k_f.spread**2, 1.0 / spread**2
    middle = (weights[0] * math.log(k_f.value) + weights[1] * math.log(other)) / sum(weights)
    apart = abs(math.log(k_f.value / other)) / 2.0
    how = f"thrust stand at {LOADED} of the speed that kV allows, and C_T = {C_T} at D = {sheet.propeller.size:.3g} m"
    return estimated(math.exp(middle), how, max(1.0 / math.sqrt(sum(weights)), 0.5 * apart))


def on_stand(stand: StandSection) -> dict[str, Floats]:
    """The columns of a thrust stand at the points at which the motor turned."""
    names = ("throttle", "thrust", "voltage", "current", "speed", "torque")
    columns = {name: np.array(getattr(stand, name)) for name in names if getattr(stand, name)}
    kept = (columns["thrust"] > 0.02 * columns["thrust"].max()) & (columns["throttle"] > 0.0)
    for name in ("voltage", "speed"):
        if name in columns:
            kept &= columns[name] > 0.0
    if kept.sum() < 3:
        raise UserError("stand: fewer than three points at which the motor turned")
    found = {name: values[kept] for name, values in columns.items()}
    if np.corrcoef(found["throttle"], found["thrust"])[0, 1] < 0.5:
        raise UserError("stand: thrust does not rise with throttle; are the columns in the right order?")
    return found


def curve(running: dict[str, Floats], speeds: Floats, nominal: float) -> tuple[Number, Number, float]:
    """Exponents of throttle and voltage, and the speed at full throttle and the nominal voltage [rad/s]."""
    columns = [np.ones(len(speeds)), np.log(running["throttle"])]
    volts = np.log(running["voltage"] / nominal) if "voltage" in running else np.zeros(len(speeds))
    # voltage that only sags as throttle rises cannot be told from throttle
    sag = np.column_stack([*columns, columns[1] ** 2])
    apart = float((volts - sag @ np.linalg.lstsq(sag, volts, rcond=None)[0]).std()) > 0.02
    wanted = np.log(speeds) - (0.0 if apart else volts)
    matrix = np.column_stack([*columns, volts] if apart else columns)
    solution, *_ = np.linalg.lstsq(matrix, wanted, rcond=None)
    rest = wanted - matrix @ solution
    errors = np.sqrt(np.diag(np.linalg.pinv(matrix.T @ matrix)) * float(rest @ rest) / max(len(wanted) - matrix.shape[1], 1))
    exponent = measured(float(solution[1]), "thrust stand, speed over throttle", max(float(errors[1] / solution[1]), 0.01))
    if apart:
        by_voltage = measured(float(solution[2]), "thrust stand", max(float(errors[2]), 0.02))
    else:
        by_voltage = usual(1.0, "not measured on the stand: speed in proportion to voltage", 0.15)
    return exponent, by_voltage, math.exp(float(solution[0]))


def torque_of(sheet: Datasheet, running: dict[str, Floats] | None, speeds: Floats, k_f: Number) -> Number:
    """k_m [N m s^2]."""
    if running and "torque" in running:
        slope, spread = through_origin(speeds**2, running["torque"])
        return measured(slope, "thrust stand, torque over speed squared", max(spread, 0.5 * k_f.spread))
    if running and "current" in running:
        idle = 0.3 * float(running["current"].min())
        slope, _ = through_origin(speeds**2, 60.0 / (2.0 * math.pi * sheet.kv) * np.maximum(running["current"] - idle, 0.0))
        return estimated(slope, "thrust stand: current times 60 / (2 pi kV)", 0.2)
    ratio = C_P / (2.0 * math.pi * C_T) * sheet.propeller.size
    return estimated(ratio * k_f.value, f"C_P = {C_P} and C_T = {C_T}: {1e3 * ratio:.2g} mm times k_f", C_P_SPREAD)


def efficiency_of(running: dict[str, Floats] | None, speeds: Floats, k_m: Number) -> Number:
    if running and "current" in running and "voltage" in running:
        electrical = running["current"] * running["voltage"]
        ratio = float(np.median(k_m.value * speeds**3 / np.maximum(electrical, 1e-9)))
        if 0.2 < ratio < 0.95:
            return estimated(ratio, "thrust stand: k_m w^3 over current times voltage", max(0.05, k_m.spread))
    return usual(0.7, "motor and controller", 0.15)


def body_inertia(sheet: Datasheet, count: int) -> tuple[Number, Number, Number]:
    """Inertia about x, y, z: motors as points on the arms, the rest as a box."""
    if sheet.inertia:
        first, second, third = (measured(value, "data sheet", 0.05) for value in sheet.inertia)
        return first, second, third
    motor = sheet.motor_mass or MOTORS * sheet.mass / count
    if count * motor > 0.9 * sheet.mass:
        raise UserError(f"motor_mass: {count} motors of {motor:g} kg leave nothing of {sheet.mass:g} kg for the rest")
    propeller = sheet.propeller.mass or 0.0
    if count * (motor + propeller) > 0.95 * sheet.mass:
        raise UserError(
            f"propeller.mass: {count} propellers of {propeller:g} kg and as many motors of {motor:g} kg leave nothing of "
            f"{sheet.mass:g} kg for the rest"
        )
    motor += propeller
    rest, side = sheet.mass - count * motor, 0.4 * sheet.wheelbase
    places = [mount.position for mount in laid_out(sheet.layout, 0.5 * sheet.wheelbase)]
    box = rest * (side**2 + (0.5 * side) ** 2) / 12.0
    about = [
        motor * sum(place[1] ** 2 for place in places) + box,
        motor * sum(place[0] ** 2 for place in places) + box,
        motor * sum(place[0] ** 2 + place[1] ** 2 for place in places) + rest * 2.0 * side**2 / 12.0,
    ]
    known = "motor_mass" if sheet.motor_mass else "40 % of the mass"
    first, second, third = (estimated(value, f"motors ({known}) as points, the rest a box", 0.25) for value in about)
    return first, second, third


def vehicle_of(sheet: Datasheet, estimate: VehicleEstimate) -> AirframeSection:
    full, empty = FULL * sheet.cells, EMPTY * sheet.cells

    def short(number: Number) -> float:
        return float(f"{number.value:.5g}")

    exponent = short(estimate.voltage_exponent)
    content = {
        "description": sheet.name, "mass": sheet.mass, "inertia": [short(one) for one in estimate.inertia], "gravity": 9.81,
        "layout": sheet.layout, "arm": 0.5 * sheet.wheelbase,
        "rotor": {
            "thrust_coefficient": short(estimate.thrust), "torque_coefficient": short(estimate.torque),
            "inertia": short(estimate.rotor_inertia), "rise_time": short(estimate.rise), "fall_time": short(estimate.rise),
            "slowest": float(f"{0.08 * estimate.fastest.value:.3g}"), "fastest": short(estimate.fastest),
            "radius": 0.5 * sheet.propeller.size,
        },
        "drag": {
            "parasitic": [short(estimate.parasitic)] * 2 + [float(f"{2.0 * estimate.parasitic.value:.5g}")],
            "rotor": [short(estimate.disc_drag), short(estimate.disc_drag), short(estimate.axial_drag)],
        },
        "battery": {
            "full": full, "empty": empty, "capacity": short(estimate.capacity), "resistance": short(estimate.resistance),
            "efficiency": short(estimate.efficiency),
        },
        "command": {
            "speed": float(f"{estimate.fastest.value * (estimate.nominal / full) ** exponent:.5g}"),
            "exponent": short(estimate.exponent), "voltage_exponent": exponent,
            "nominal_voltage": float(f"{estimate.nominal:.5g}"), "delay": 0.01,
        },
        "sources": {
            "mass": "data sheet", "arm": "data sheet: half the wheelbase", "layout": "data sheet", "gravity": "standard",
            "inertia": estimate.inertia[0].source,
            "rotor.thrust_coefficient": estimate.thrust.source, "rotor.torque_coefficient": estimate.torque.source,
            "rotor.inertia": estimate.rotor_inertia.source,
            "rotor.rise_time": estimate.rise.source, "rotor.fall_time": estimate.rise.source,
            "rotor.slowest": "usual: 8 % of the fastest", "rotor.fastest": estimate.fastest.source,
            "rotor.radius": "data sheet: half the propeller's diameter",
            "drag.parasitic": estimate.parasitic.source, "drag.rotor": estimate.disc_drag.source,
            "drag.flapping": "usual: none", "drag.translational_lift": "usual: none",
            "battery.full": f"usual: {FULL} V a cell", "battery.empty": f"usual: {EMPTY} V a cell",
            "battery.capacity": estimate.capacity.source, "battery.resistance": estimate.resistance.source,
            "battery.efficiency": estimate.efficiency.source,
            "command.speed": estimate.fastest.source, "command.exponent": estimate.exponent.source,
            "command.voltage_exponent": estimate.voltage_exponent.source,
            "command.nominal_voltage": "where command.speed holds", "command.delay": "usual: 10 ms, ±50 %",
        },
    }  # fmt: skip
    return AirframeSection.model_validate(content)
