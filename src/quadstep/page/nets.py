"""What the page shows of the first net of the paper's law: neurons, weights, its force and the one that it should make."""

from typing import cast

from quadstep.control.backstepping import Backstepping, BacksteppingGains, BacksteppingMemory, position_loop
from quadstep.control.completed_backstepping import CompletedBackstepping, CompletedGains, CompletedMemory
from quadstep.control.networks import output
from quadstep.engines.loop import Cycle, Loop, Numbers
from quadstep.interfaces.closed_loop import ClosedLoop
from quadstep.numbers import Number, where
from quadstep.vehicle.paper.state import State
from quadstep.vehicle.plants.lagrange import Lagrange, Parameters


def net_row(loop: ClosedLoop, cycle: object, p: object, time: Number) -> list[Number]:
    """Of a flight at time t [s], for the N neurons of the net: mu_1 (N), W_1 (N rows of 3), W_1^T mu_1 [N], -A_xyz [N].

    Empty where the loop has no such net, or its plant no such disturbance.
    """
    if not isinstance(loop, Loop) or not isinstance(loop.plant, Lagrange):
        return []
    flown, numbers = cast(Cycle, cycle), cast(Numbers, p)
    state, parameters = cast(State, flown.state), cast(Parameters, p)
    if isinstance(loop.controller, Backstepping):
        gains, memory = cast(BacksteppingGains, numbers.gains), cast(BacksteppingMemory, flown.memory)
    elif isinstance(loop.controller, CompletedBackstepping):
        gains, memory = cast(CompletedGains, numbers.gains).paper, cast(CompletedMemory, flown.memory).paper
    else:
        return []
    on = where(time >= gains.learning_start, 1.0, 0.0)
    outer = position_loop(gains, memory, cast(State, loop.told(flown, numbers)), loop.wanted(time, numbers), on)
    force, _ = loop.plant.disturbed(parameters, state, time)
    weights = [entry for row in memory.weights_1 for entry in row]
    return [*outer.mu_1, *weights, *(on * output(memory.weights_1, outer.mu_1)), *(-force)]


def neurons_of(row: list[Number]) -> int:
    """How many neurons the net of a row has."""
    return max(0, (len(row) - 6) // 4)
