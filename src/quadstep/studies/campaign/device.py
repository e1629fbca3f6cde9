"""A campaign on a graphics processor, which draws the varying values and the noise itself where it can.

The same laws draw the values: the mission is built once more, with the processor's numbers in place of arrays.
"""

import numpy as np
import pyarrow as pa

from quadstep.engines.cuda import Device
from quadstep.engines.gpu_sweep import GpuSweep
from quadstep.engines.sweep_trace import Generate
from quadstep.interfaces.closed_loop import Advance
from quadstep.mission.distributions import Choice, Grid, Sobol
from quadstep.numbers import Number, flatten
from quadstep.numbers.noise import flight_key, key
from quadstep.studies.campaign.draws import continuous, draw, shares
from quadstep.studies.campaign.flyer import FlightRange, Fly, Flyer, table
from quadstep.studies.campaign.planner import TYPICAL, PlannedBatch, Planner
from quadstep.studies.campaign.schema import Campaign


def device_flyer(campaign: Campaign) -> Flyer:
    """A flyer for the graphics processor. Raises UserError where there is none."""
    Device()  # refuse before anything else is done
    flyer = Flyer(campaign, GpuSweep)
    only = generated_batch(flyer)
    return flyer if only is None else DeviceFlyer(campaign, flyer.planner, only)


def on_gpu(campaign: Campaign) -> Fly[FlightRange]:
    """What flies a campaign there. Raises UserError where there is none, and for a campaign that cannot be flown."""
    flyer = device_flyer(campaign)
    flyer.rehearse()
    return flyer.fly_spans


def generated_batch(flyer: Flyer) -> PlannedBatch | None:
    """The one batch of a campaign whose values can be drawn on the device; None for any other campaign."""
    file = flyer.campaign.file
    if any(isinstance(one, Choice | Grid | Sobol) for one in file.vary.values()):
        return None
    flights = np.arange(TYPICAL)
    batches = list(flyer.planner.batches(flights, draw(file, flights)))
    direct = flyer.planner.direct[()]
    return batches[0] if len(batches) == 1 and len(direct) == len(file.keys) else None


def generate(campaign: Campaign, planner: Planner, batch: PlannedBatch) -> Generate:
    """The law that computes the varying numbers of a flight from its number."""
    base = key(campaign.file.seed, 0).words
    values = {name: column.at(0) for name, column in planner.typical.items()}

    def law(high: Number, low: Number) -> list[Number]:
        own = flight_key(base, high, low)
        plan = planner.built(values, continuous(campaign.file, shares(campaign.file, own)))
        if hasattr(plan.parameters, "key"):
            plan = plan._replace(parameters=plan.parameters._replace(key=own))
        leaves = flatten((plan.start, plan.parameters))
        return [leaves[place] for place in sorted(batch.places)]

    return law


class DeviceFlyer(Flyer):
    """Flies flights whose values are drawn on the device."""

    def __init__(self, campaign: Campaign, planner: Planner, batch: PlannedBatch) -> None:
        self.campaign, self.planner, self.batch = campaign, planner, batch
        law = generate(campaign, planner, batch)
        self.device = GpuSweep(
            batch.loop, batch.ticks, batch.start, batch.parameters, batch.places, campaign.double, generate=law
        )

    def fly(self, first: int, past: int, progress: Advance | None = None) -> pa.Table:
        """The flights from `first` up to `past`. The drawn values are written as they are drawn here, in f64.

        Raises UserError for values that cannot be flown.
        """
        flights = np.arange(first, past)
        drawn = draw(self.campaign.file, flights)
        self.planner.check((), {}, {name: column.values for name, column in drawn.items()}, flights)
        swept, _ = self.device.generated(first, past, progress)
        return table(self.campaign, flights, drawn, swept.outcome, swept.ended, swept.metrics)
