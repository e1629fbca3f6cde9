"""Hovers with a chirp added to one torque that the law commands, as an autopilot's system identification adds it."""

import math
from dataclasses import dataclass

import numpy as np

from quadstep.engines.loop import Loop
from quadstep.linear.states import with_addition
from quadstep.mission.schema import Mission
from quadstep.numbers import clip, exp, sin
from quadstep.sensing.sensors import passed

SLOWEST, FASTEST, DURATION, FADE = 0.3, 25.0, 40.0, 2.0
"""Frequencies of the chirp [Hz], how long it takes, and how long it fades in and out [s]."""


@dataclass(frozen=True)
class Injected(Loop):
    """channel: of roll, pitch and yaw. strength [rad/s^2]: amplitude of the chirp over the inertia. begin [s]."""

    channel: int = 0
    strength: float = 2.0
    begin: float = 1.0

    def chirp(self, t, p):
        """What is added to the torque [N m]; its frequency grows exponentially."""
        since = clip(t - self.begin, 0.0, DURATION)
        pace = DURATION / math.log(FASTEST / SLOWEST)
        fade = clip(since / FADE, 0.0, 1.0) * clip((DURATION - since) / FADE, 0.0, 1.0)
        phase = 2.0 * math.pi * SLOWEST * pace * (exp(since / pace) - 1.0)
        return self.strength * p.airframe.inertia[self.channel] * fade * sin(phase)

    def law(self, cycle, p, clock):
        reference = self.reference(clock.time, p)
        given = self.measurement(cycle, p), reference, p.gains, clock.time, clock.period
        asked, memory = self.controller.law(cycle.memory, *given)
        command = self.plant.logged_command(p, asked)
        code = self.plant.outcome(p, cycle.state, command, reference)
        by = [0.0, 0.0, 0.0, 0.0]
        by[self.channel + 1] = self.chirp(clock.time, p)
        waiting, held = passed(cycle.waiting, self.plant.actuate(p, with_addition(p, asked, by)))
        return cycle._replace(memory=memory, command=command, held=held, waiting=waiting), code


def injected(mission: Mission, channel: int = 0, strength: float = 2.0):
    """The plan of the mission with a chirp on one torque."""
    plan = mission.plan(warn=False)
    loop = plan.loop
    fields = {name: getattr(loop, name) for name in loop.__dataclass_fields__}
    return plan._replace(loop=Injected(**fields, channel=channel, strength=strength))


def signals(plan, flight):
    """Excitation, the command that holds it, before the rotors' limits [N m], and their period [s]."""
    t = flight.column("t")
    excitation = np.array([float(plan.loop.chirp(float(one), plan.parameters)) for one in t])
    return excitation, flight.column(f"tau_{'xyz'[plan.loop.channel]}") + excitation, float(t[1] - t[0])
