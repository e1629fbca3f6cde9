"""What the page shows of the first net of the paper's law: neurons, weights, its force and the one that it should make."""

from quadstep.control.backstepping import Backstepping, position_loop
from quadstep.control.completed_backstepping import CompletedBackstepping
from quadstep.control.networks import output
from quadstep.flight.closed_loop import ClosedLoop
from quadstep.flight.loop import Loop
from quadstep.numbers import Number, Structure, where
from quadstep.plants.lagrange import Lagrange


def net_row(loop: ClosedLoop, cycle: Structure, p: Structure, time: Number) -> list[Number]:
    """Of a flight at time t [s], for the N neurons of the net: mu_1 (N), W_1 (N rows of 3), W_1^T mu_1 [N], -A_xyz [N].

    Empty where the loop has no such net, or its plant no such disturbance.
    """
    if not isinstance(loop, Loop) or not isinstance(loop.plant, Lagrange):
        return []
    if isinstance(loop.controller, Backstepping):
        gains, memory = p.gains, cycle.memory
    elif isinstance(loop.controller, CompletedBackstepping):
        gains, memory = p.gains.paper, cycle.memory.paper
    else:
        return []
    on = where(time >= gains.learning_start, 1.0, 0.0)
    outer = position_loop(gains, memory, loop.told(cycle, p), loop.wanted(time, p), on)
    force, _ = loop.plant.disturbed(p, cycle.state, time)
    weights = [entry for row in memory.weights_1 for entry in row]
    return [*outer.mu_1, *weights, *(on * output(memory.weights_1, outer.mu_1)), *(-force)]


def neurons_of(row: list[Number]) -> int:
    """How many neurons the net of a row has."""
    return max(0, (len(row) - 6) // 4)
