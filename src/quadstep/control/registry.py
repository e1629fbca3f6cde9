"""The controllers of the package, by what they are told: those of one kind of vehicle are loaded when they are asked for."""

from importlib import import_module

from quadstep.control.controller import Controller, Measured
from quadstep.control.gain import kept
from quadstep.control.rate_loop import following_rates
from quadstep.plants.planar import PlanarState
from quadstep.vehicle.state import State

BUILT_IN: dict[type, tuple[str, ...]] = {
    State: (
        "backstepping.Backstepping",
        "completed_backstepping.CompletedBackstepping",
        "nested_saturation.NestedSaturation",
    ),
    Measured: (
        "geometric.Geometric",
        "cascaded_pid.CascadedPid",
        "lqr.Lqr",
        "rotation_backstepping.RotationBackstepping",
        "paper_on_airframe.PaperOnAirframe",
        "indi.Indi",
        "indi.IndiVelocity",
        "geometric_l1.GeometricL1",
        "geometric_adaptive.GeometricAdaptive",
        "adrc.Adrc",
        "super_twisting.SuperTwisting",
        "flatness.Flatness",
        "thrust_extended_backstepping.ThrustExtendedBackstepping",
        "state_space_backstepping.StateSpaceBackstepping",
        "dynamic_linearisation.DynamicLinearisation",
        "h_infinity_linearisation.HInfinityLinearisation",
        "loop_shaping.LoopShaping",
        "nested_saturation_on_airframe.NestedSaturationOnAirframe",
        "hedged_inversion.HedgedInversion",
        "filtered_backstepping.FilteredBackstepping",
        "planned_lqr.PlannedLqr",
    ),
    PlanarState: ("planar_pd.PlanarPd", "planar_linearisation.PlanarLinearisation"),
}
"""Module and class, in the order in which users are told of them."""


@kept
def controllers(measures: type) -> dict[str, type[Controller]]:
    """Those that are told such a measurement, by name."""
    found: list[type[Controller]] = []
    for place in BUILT_IN.get(measures, ()):
        module, name = place.split(".")
        found.append(getattr(import_module(f"quadstep.control.{module}"), name))
    return {law.name: following_rates(law) for law in found}
