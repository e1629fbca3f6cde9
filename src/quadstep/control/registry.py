"""The controllers of the package, by what they are told: each is loaded when it is asked for."""

from importlib import import_module

from quadstep.control.rate_loop import following_rates
from quadstep.interfaces.controller import Controller, Measured
from quadstep.interfaces.gain import cached_by_class
from quadstep.vehicle.paper import State
from quadstep.vehicle.planar import PlanarState

BUILT_IN: dict[type, dict[str, str]] = {
    State: {
        "backstepping": "backstepping.Backstepping",
        "completed-backstepping": "completed_backstepping.CompletedBackstepping",
        "nested-saturation": "nested_saturation.NestedSaturation",
    },
    Measured: {
        "geometric": "geometric.Geometric",
        "pid": "cascaded_pid.CascadedPid",
        "lqr": "lqr.Lqr",
        "rotation-backstepping": "rotation_backstepping.RotationBackstepping",
        "backstepping": "paper_on_airframe.PaperOnAirframe",
        "indi": "indi.Indi",
        "indi-velocity": "indi.IndiVelocity",
        "geometric-l1": "geometric_l1.GeometricL1",
        "geometric-adaptive": "geometric.GeometricAdaptive",
        "adrc": "adrc.Adrc",
        "super-twisting": "super_twisting.SuperTwisting",
        "flatness": "flatness.Flatness",
        "thrust-extended-backstepping": "thrust_extended_backstepping.ThrustExtendedBackstepping",
        "state-space-backstepping": "state_space_backstepping.StateSpaceBackstepping",
        "dynamic-linearisation": "dynamic_linearisation.DynamicLinearisation",
        "h-infinity-linearisation": "h_infinity_linearisation.HInfinityLinearisation",
        "loop-shaping": "loop_shaping.LoopShaping",
        "mpc": "mpc.Mpc",
        "mppi": "mppi.Mppi",
        "raptor": "raptor.Raptor",
        "nested-saturation": "nested_saturation.NestedSaturationOnAirframe",
        "hedged-backstepping": "hedged_backstepping.HedgedBackstepping",
        "hedged-inversion": "hedged_inversion.HedgedInversion",
        "filtered-backstepping": "filtered_backstepping.FilteredBackstepping",
        "planned-lqr": "lqr.PlannedLqr",
        "crazyflie-pid": "crazyflie_pid.CrazyfliePid",
        "crazyflie-mellinger": "crazyflie_mellinger.CrazyflieMellinger",
        "px4-cascade": "px4_cascade.Px4Cascade",
        "ardupilot-cascade": "ardupilot_cascade.ArduPilotCascade",
        "betaflight-rates": "betaflight_rates.BetaflightRates",
    },
    PlanarState: {"planar-pd": "planar.PlanarPd", "planar-linearisation": "planar.PlanarLinearisation"},
}
"""Module and class by the name in missions, in the order in which users are told of them."""

FLOWN = {State: "the paper's plant", Measured: "real vehicles", PlanarState: "the planar vehicle"}
"""What the controllers fly that are told such a measurement."""

STOCK = ("crazyflie-pid", "crazyflie-mellinger", "px4-cascade", "ardupilot-cascade", "betaflight-rates")
"""Laws of autopilots, with an autopilot's default gains for its own vehicle: they do not follow from any other."""


@cached_by_class
def controller(measures: type, name: str) -> type[Controller] | None:
    """The one of that name which is told such a measurement; None where there is none. The others are not loaded."""
    place = BUILT_IN.get(measures, {}).get(name)
    if place is None:
        return None
    module, law = place.split(".")
    found: type[Controller] = getattr(import_module(f"quadstep.control.{module}"), law)
    return following_rates(found)


def flown_by(name: object) -> str:
    """What the controller of this name flies, in words; nothing where there is none."""
    return " and ".join(words for measures, words in FLOWN.items() if name in names(measures))


def names(measures: type) -> tuple[str, ...]:
    """Those that are told such a measurement."""
    return tuple(BUILT_IN.get(measures, {}))


def controllers(measures: type) -> dict[str, type[Controller]]:
    """Those that are told such a measurement, by name; all are loaded."""
    return {name: law for name in names(measures) if (law := controller(measures, name))}
