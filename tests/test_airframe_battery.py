"""Battery sag: the circuit's equation, its limits, and the remaining rotor speed."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadstep.numbers import vector
from quadstep.vehicle.rigid_body import Effects
from quadstep.vehicle.rotor import Battery, electrical_power, open_circuit, terminal_voltage
from tests.airframes import airframe, at, fly, rate_of

BATTERY = Battery(full=12.6, empty=10.0, capacity=8000.0, resistance=0.03, efficiency=0.8)
SAGGING = Effects(battery=True, gyroscopic=False, drag=False)


def test_power_is_torque_times_speed_over_efficiency():
    got = electrical_power(BATTERY, 1e-7, vector(100.0, 200.0, 300.0, 400.0))
    assert got == pytest.approx(1e-7 * (1e6 + 8e6 + 27e6 + 64e6) / 0.8)


def test_open_circuit_voltage_falls_evenly_from_full_to_empty_and_not_without_end():
    assert open_circuit(BATTERY, 0.0) == 12.6
    assert open_circuit(BATTERY, 8000.0) == pytest.approx(10.0)
    assert open_circuit(BATTERY, 2000.0) == pytest.approx(12.6 - 0.25 * 2.6)
    assert open_circuit(BATTERY, 1e9) == 1.0


@given(st.floats(0.0, 8000.0), st.floats(0.0, 700.0), st.floats(0.0, 0.035))
def test_terminal_voltage_solves_the_circuit(charge, power, resistance):
    volts = terminal_voltage(BATTERY._replace(resistance=resistance), charge, power)
    opened = 12.6 - 2.6 * charge / 8000.0
    assert volts + resistance * power / volts == pytest.approx(opened, rel=1e-12)
    assert volts >= 0.5 * opened  # the root that is reached from no load


def test_voltage_sags_with_load_and_with_charge():
    loads = [terminal_voltage(BATTERY, 1000.0, power) for power in np.linspace(0.0, 1000.0, 50)]
    charges = [terminal_voltage(BATTERY, charge, 200.0) for charge in np.linspace(0.0, 8000.0, 50)]
    assert np.all(np.diff(loads) < 0)
    assert np.all(np.diff(charges) < 0)
    assert loads[0] == open_circuit(BATTERY, 1000.0)


def test_more_than_the_battery_can_give_leaves_half_of_its_voltage():
    most = 12.6**2 / (4 * 0.03)
    assert terminal_voltage(BATTERY, 0.0, most) == pytest.approx(6.3, rel=1e-6)
    assert terminal_voltage(BATTERY, 0.0, 5 * most) == 6.3


def test_the_greatest_speed_goes_with_the_voltage():
    for charge in (0.0, 6000.0):
        end = fly(at(speeds=[500.0] * 4, charge=charge), 5000.0, 0.6, effects=SAGGING)
        power = 1.5e-7 * sum(w**3 for w in end.speeds) / 0.8
        volts = terminal_voltage(airframe().battery, end.charge, power)
        assert end.speeds[0] == pytest.approx(1000.0 * volts / 12.6, rel=1e-4)
        assert fly(at(speeds=[500.0] * 4, charge=charge), 5000.0, 0.6).speeds[0] == pytest.approx(1000.0)


def test_charge_is_drawn_by_the_current():
    end = fly(at(speeds=[600.0] * 4), 600.0, 10.0, step=0.05, effects=SAGGING)
    power = 4 * 1.5e-7 * 600.0**3 / 0.8
    current = power / terminal_voltage(airframe().battery, 0.0, power)
    assert end.charge == pytest.approx(10.0 * current, rel=3e-3)
    assert end.speeds[0] == 600.0
    assert rate_of(at(speeds=[600.0] * 4), 600.0).charge == 0.0
