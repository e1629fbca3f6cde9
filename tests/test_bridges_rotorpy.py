"""Our controllers called by RotorPy, RotorPy's in our missions."""

from importlib import import_module

import numpy as np
import pytest

from quadstep.bridges.rotorpy import Adapter, Trajectory, from_rotorpy, rotorpy_state, to_quad_params
from quadstep.control.opaque import MeasuredArrays, ReferenceArrays, flying
from quadstep.engines.fly import fly
from quadstep.interfaces.closed_loop import Outcome
from quadstep.interfaces.controller import Command, Controller
from quadstep.io.errors import UserError
from quadstep.metrics.registry import flight_metrics
from quadstep.mission.multirotor import MultirotorMission
from quadstep.mission.schema import Mission
from quadstep.numbers import vector
from tests.needs import package

CIRCLE = {"type": "circle", "radius": 1.0, "period": 4.0, "ramp": 1.0, "centre": [0.0, 0.0, 2.0], "yaw_rate": 0.5}


def mission(duration=2.0, controller="geometric", **parts):
    content = {
        "vehicle": {"preset": "hummingbird", "effects": {"gyroscopic": False}},
        "path": CIRCLE,
        "controller": {"type": controller},
        "simulation": {"step": 0.001, "control_period": 0.004, "guidance_period": 0.008, "log_period": 0.008},
        **parts,
    }
    content["simulation"] = {**content["simulation"], "duration": duration}
    return MultirotorMission.model_validate(content)


def rmse(log):
    assert log.outcome is Outcome.COMPLETED
    return flight_metrics(log)["position_rmse[m]"]


def apart(one, other, *names):
    return np.abs(one.table(*names) - other.table(*names)).max()


@pytest.fixture
def rotorpy():
    """What imports a part of RotorPy."""
    package("rotorpy.vehicles.multirotor")
    return lambda name: import_module(f"rotorpy.{name}")


def fly_on_rotorpy(plan):
    return import_module("examples.fly_rotorpy").fly_on_rotorpy(plan)


# Whole flights


def test_geometric_control_flies_rotorpys_hummingbird_as_it_flies_ours(rotorpy):
    wind = {"mean": [2.0, -1.0, 0.0], "swing": [0.0, 2.0, 1.0], "swing_frequency": 4.0}
    plan = mission(3.0, wind=wind).plan()
    ours, theirs = fly(plan), fly_on_rotorpy(plan)
    assert 0.01 < rmse(ours) < 0.2
    assert rmse(theirs) == pytest.approx(rmse(ours), rel=1e-4)
    assert apart(ours, theirs, "x", "y", "z") < 1e-5
    assert apart(ours, theirs, "q_w", "q_x", "q_y", "q_z") < 1e-5
    for names in (["t"], ["x_d", "y_d", "z_d"], ["wind_x", "wind_y", "wind_z"]):
        assert apart(ours, theirs, *names) < 1e-12
    for names in (["u", "u_a"], ["tau_x", "tau_y", "tau_z"], ["f1", "f2", "f3", "f4"], ["yaw_d", "pitch_d", "roll_d"]):
        assert apart(ours, theirs, *names) < 1e-3


@pytest.mark.parametrize("controller", ["rotation-backstepping", "pid", "lqr", "backstepping"])
def test_every_law_flies_alike_on_both_vehicles_at_its_two_rates(rotorpy, controller):
    plan = mission(0.6, controller).plan()
    ours, theirs = fly(plan), fly_on_rotorpy(plan)
    assert theirs.outcome is ours.outcome is Outcome.COMPLETED
    assert apart(ours, theirs, "x", "y", "z") < 1e-5
    assert apart(ours, theirs, "norm_W1", "norm_W2") < 1e-3


def test_rotorpys_controller_flies_our_hummingbird_as_it_flies_its_own(rotorpy):
    control = rotorpy("controllers.quadrotor_control").SE3Control
    plan = mission(3.0).plan()
    params = to_quad_params(mission().vehicle.build())
    with flying(from_rotorpy(control(params))) as (law, gains):
        ours = fly(plan.with_controller(law, gains))
        theirs = fly_on_rotorpy(plan.with_controller(law, gains))
    assert 0.01 < rmse(ours) < 0.2
    assert rmse(theirs) == pytest.approx(rmse(ours), rel=1e-4)
    assert apart(ours, theirs, "x", "y", "z") < 1e-5


def test_a_flight_that_leaves_its_path_ends_alike_on_both(rotorpy):
    plan = mission(2.0, limits={"distance": 0.03}).plan()
    ours, theirs = fly(plan), fly_on_rotorpy(plan)
    assert ours.outcome is theirs.outcome is Outcome.OFF_PATH
    assert theirs.ended == ours.ended < 2.0
    assert len(theirs.rows) == len(ours.rows)


def test_the_preset_is_rotorpys_hummingbird(rotorpy):
    vehicle = {"preset": "hummingbird", "effects": {"gyroscopic": False}, "rotor": {"fastest": 1500.0}}
    params = to_quad_params(mission(vehicle=vehicle).vehicle.build())
    theirs = rotorpy("vehicles.hummingbird_params").quad_params
    assert params.keys() <= theirs.keys()
    for key, value in params.items():
        if key == "rotor_pos":
            for name, place in value.items():
                np.testing.assert_allclose(place, theirs[key][name], rtol=1e-9)
        else:
            np.testing.assert_allclose(value, theirs[key], err_msg=key)


def test_rotorpys_own_loop_flies_our_controller_on_our_path(rotorpy):
    environments, zeros = rotorpy("environments"), np.zeros(3)
    plan = mission(1.0).plan()
    start = {**rotorpy_state(plan.start), "wind": zeros}
    environment = environments.Environment(
        vehicle=rotorpy("vehicles.multirotor").Multirotor(to_quad_params(mission().vehicle.build()), start),
        controller=Adapter(plan),
        trajectory=Trajectory(plan),
        sim_rate=250,
    )
    flown = environment.run(t_final=0.5, use_mocap=False, terminate=False, plot=False, animate_bool=False, verbose=False)
    ours = fly(plan)
    places = flown["state"]["x"][::2][: len(ours.rows)]
    np.testing.assert_allclose(places, ours.table("x", "y", "z")[: len(places)], atol=1e-5)


# Parts


def flat(position=(0.0, 0.0, 2.0)):
    zeros = np.zeros(3)
    return {
        **{"x": np.array(position), "x_dot": zeros, "x_ddot": zeros, "x_dddot": zeros, "x_ddddot": zeros},
        **{"yaw": 0.0, "yaw_dot": 0.0},
    }


class Counting(Controller):
    """A law that notes when it is asked and with which period, and wants a little more thrust each time."""

    def __init__(self):
        object.__setattr__(self, "asked", [])

    def start(self, measured, gains):
        self.asked.append(("start", measured))
        return 4.0

    def guide(self, memory, measured, reference, gains, t, period):
        self.asked.append(("guide", round(t, 6), period))
        return memory + 0.1

    def law(self, memory, measured, reference, gains, t, period):
        self.asked.append(("law", round(t, 6), period))
        self.measured, self.reference = measured, reference
        return Command(memory, vector(0.01, 0.02, 0.003), desired_attitude=vector(0.5, 0.0, 0.0)), memory


def counting():
    law = Counting()
    return law, Adapter(mission().plan().with_controller(law, None))


def test_both_loops_run_at_their_own_rates_and_in_between_the_answer_holds():
    law, controller = counting()
    state = rotorpy_state(mission().plan().start)
    thrusts = [controller.update(0.002 * i, state, flat())["cmd_thrust"] for i in range(9)]
    guided, ran = ([t for name, t, *_ in law.asked if name == which] for which in ("guide", "law"))
    assert guided == [0.0, 0.008, 0.016]
    assert ran == [0.0, 0.004, 0.008, 0.012, 0.016]
    assert thrusts == pytest.approx([4.1] * 4 + [4.2] * 4 + [4.3])
    assert {period for name, *_, period in law.asked if name == "guide"} == {0.008}
    assert {period for name, *_, period in law.asked if name == "law"} == {0.004}


def test_a_new_flight_starts_anew():
    law, controller = counting()
    state = rotorpy_state(mission().plan().start)
    first = [controller.update(0.004 * i, state, flat())["cmd_thrust"] for i in range(4)]
    assert [controller.update(0.004 * i, state, flat())["cmd_thrust"] for i in range(4)] == first
    assert [entry[0] for entry in law.asked].count("start") == 2


@pytest.mark.parametrize("step", [0.003, 0.01])
def test_steps_that_do_not_fit_are_refused(step):
    _, controller = counting()
    state = rotorpy_state(mission().plan().start)
    controller.update(0.0, state, flat())
    with pytest.raises(UserError, match=r"period = 0\.00[48] s must be a whole multiple of RotorPy's step"):
        controller.update(step, state, flat())


def test_the_law_is_told_the_state_the_path_and_what_the_rotors_made():
    law, controller = counting()
    state = {"x": [1, 2, 3], "v": [4, 5, 6], "q": np.array([0.1, 0.2, 0.3, np.sqrt(0.86)]), "w": np.array([7.0, 8.0, 9.0])}
    wanted = {
        **{"x": [1, 1, 1], "x_dot": [2, 2, 2], "x_ddot": [3, 3, 3], "x_dddot": [4, 4, 4], "x_ddddot": [5, 5, 5]},
        **{"yaw": 0.6, "yaw_dot": 0.7},
    }
    answer = controller.update(0.0, state, wanted)
    measured, reference = law.measured, law.reference
    assert [list(part) for part in measured[:4]] == [[1, 2, 3], [4, 5, 6], [np.sqrt(0.86), 0.1, 0.2, 0.3], [7, 8, 9]]
    assert [reference[i][0] for i in (0, 1, 2, 5, 6)] == [1, 2, 3, 4, 5]
    assert (reference.yaw, reference.yaw_rate) == (0.6, 0.7)
    assert measured.thrust == 0.0
    np.testing.assert_allclose(answer["cmd_q"], [0, 0, np.sin(0.25), np.cos(0.25)], atol=1e-12)
    thrusts = answer["cmd_motor_thrusts"]
    np.testing.assert_allclose(thrusts, 5.57e-6 * answer["cmd_motor_speeds"] ** 2)
    arm, moment = 0.1202081528, 1.36e-7 / 5.57e-6
    np.testing.assert_allclose(arm * (np.array([1, -1, -1, 1]) @ thrusts), 0.01, rtol=1e-9)  # the left ones roll it right
    np.testing.assert_allclose(arm * (np.array([-1, -1, 1, 1]) @ thrusts), 0.02, rtol=1e-9)  # the rear ones pitch it down
    np.testing.assert_allclose(moment * (np.array([1, -1, 1, -1]) @ thrusts), 0.003, rtol=1e-9)
    assert thrusts.sum() == pytest.approx(answer["cmd_thrust"]) == pytest.approx(4.1)
    np.testing.assert_allclose(answer["cmd_moment"], [0.01, 0.02, 0.003])
    controller.update(0.004, state, wanted)
    assert law.measured.thrust == pytest.approx(4.1)
    np.testing.assert_allclose(list(law.measured.torque), [0.01, 0.02, 0.003])


def test_a_path_is_told_at_any_time_and_at_infinity():
    plan = mission(2.0).plan()
    trajectory = Trajectory(plan)
    wanted, told = plan.loop.path.reference(1.3, plan.parameters.path), trajectory.update(1.3)
    for key, part in zip(
        ("x", "x_dot", "x_ddot", "x_dddot", "x_ddddot"), (*wanted[:3], wanted.jerk, wanted.snap), strict=True
    ):
        np.testing.assert_array_equal(told[key], list(part))
    np.testing.assert_array_equal(trajectory.update(np.inf)["x"], trajectory.update(2.0)["x"])


class Noting:
    """A controller as RotorPy has them."""

    def __init__(self, **answer):
        self.answer = answer

    def update(self, t, state, flat_output):
        self.told = t, state, flat_output
        return self.answer


KNOWN = MeasuredArrays(np.arange(3.0), np.arange(3.0) + 3, np.array([0.4, 0.1, 0.2, 0.3]), np.arange(3.0) + 6, 0.004)
WANTED = ReferenceArrays(np.arange(3.0) + 9, np.arange(3.0) + 12, np.arange(3.0) + 15, 0.1, 0.2)


def test_rotorpys_controller_is_told_everything_in_its_own_words():
    noting = Noting(cmd_thrust=np.float64(5.0), cmd_moment=np.array([0.1, 0.2, 0.3]))
    thrust, torque = from_rotorpy(noting)(1.5, KNOWN, WANTED)
    assert thrust == 5.0
    assert list(torque) == [0.1, 0.2, 0.3]
    t, state, wanted = noting.told
    assert t == 1.5
    for key, told in {"x": [0, 1, 2], "v": [3, 4, 5], "q": [0.1, 0.2, 0.3, 0.4], "w": [6, 7, 8]}.items():
        np.testing.assert_array_equal(state[key], told)
    for key, told in {"x": [9, 10, 11], "x_dot": [12, 13, 14], "x_ddot": [15, 16, 17], "x_dddot": 0, "x_ddddot": 0}.items():
        np.testing.assert_array_equal(wanted[key], told)
    assert (wanted["yaw"], wanted["yaw_dot"]) == (0.1, 0.2)


def test_a_controller_that_gives_no_moment_is_refused():
    with pytest.raises(UserError, match="Noting returns no cmd_moment"):
        from_rotorpy(Noting(cmd_thrust=5.0))(0.0, KNOWN, WANTED)


# Bad input


def test_the_papers_plant_is_refused():
    path = {"type": "minimum-jerk", "end": [20.0, 5.0, 10.0], "duration": 10.0}
    with pytest.raises(UserError, match="RotorPy flies real vehicles"):
        Adapter(Mission.model_validate({"path": path}).plan())


@pytest.mark.parametrize(("parts", "said"), [
    ({"wind": {"mean": [5.0, 0.0, 0.0], "turbulence": {"intensity": "light"}}}, "turbulence"),
    ({"sensors": {"position_noise": 0.01}}, "sensors"),
    ({"events": [{"type": "payload", "time": 0.5, "mass": 0.1}]}, "events"),
    ({"vehicle": {"preset": "hummingbird"}}, "gyroscopic"),
    ({"vehicle": {"preset": "hummingbird", "layout": "hexa-x", "arm": 0.2}}, "four rotors"),
])  # fmt: skip
def test_what_rotorpys_vehicle_has_not_is_refused(rotorpy, parts, said):
    with pytest.raises(UserError, match=said):
        fly_on_rotorpy(mission(**parts).plan())
