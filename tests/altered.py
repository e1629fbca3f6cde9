"""Loops at rest whose commands are altered on their way to the rotors, unseen by the law."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from quadstep.interfaces.controller import Controller
from quadstep.linear.equilibrium import Rest
from quadstep.linear.sampled import Loops
from quadstep.linear.states import with_addition
from quadstep.numbers import flatten, rebuild


class Altered(Loops):
    """What of the command deviates from rest is changed by `change`."""

    def __init__(self, rest: Rest) -> None:
        super().__init__(rest.loops.plan)
        self.trim = rest.flown.asked
        self.command = rest.loops.tasks(rest.flown, rest.first, rest.loops.p)[1]

    def change(self, flown: Any, k: int) -> tuple[Any, list[Any]]:
        """The loop and, by channel, what is added to the command that it holds."""
        raise NotImplementedError

    def step(self, flown: Any, k: int) -> Any:
        """The rotors get the changed command, the law and its delays keep theirs."""
        flown, by = self.change(flown, k)
        before, actuate = flown.cycle.held, self.loop.plant.actuate
        there, here = actuate(self.p, with_addition(self.p, self.command, by)), actuate(self.p, self.command)
        more = [held + (a - b) for held, a, b in zip(flatten(before), flatten(there), flatten(here), strict=True)]
        after = super().step(flown._replace(cycle=flown.cycle._replace(held=rebuild(before, iter(more)))), k)
        return after._replace(cycle=after.cycle._replace(held=before))


class Scaled(Altered):
    """One channel scaled by a factor."""

    def __init__(self, rest: Rest, channel: int, factor: float) -> None:
        super().__init__(rest)
        self.channel, self.factor = channel, factor

    def change(self, flown, k):
        by = [0.0] * len(self.trim)
        by[self.channel] = (self.factor - 1.0) * (flown.asked[self.channel] - self.trim[self.channel])
        return flown, by


def carrying(controller: Controller) -> Controller:
    """The controller with a memory of which it leaves a second part alone."""
    law: Any = type(controller)

    class Carrying(law):
        def start(self, *given):
            return super().start(*given), ()

        def slower(self, loop, memory, *given):
            return super().slower(loop, memory[0], *given), memory[1]

        def law(self, memory, *given):
            command, own = super().law(memory[0], *given)
            return command, (own, memory[1])

    made = object.__new__(Carrying)
    made.__dict__.update(vars(controller))
    return made


class Delayed(Altered):
    """Channels some samples late. `begun` carries the commands that are on their way."""

    def __init__(self, rest: Rest, channels: Iterable[int], late: int) -> None:
        super().__init__(rest)
        self.channels = set(channels)
        self.loop = replace(self.loop, controller=carrying(self.loop.controller))
        cycle = rest.flown.cycle
        self.begun = rest.flown._replace(cycle=cycle._replace(memory=(cycle.memory, (self.trim,) * (late + 1))))

    def change(self, flown, k):
        own, line = flown.cycle.memory
        if self.due(k)[-1]:
            line = (*line, flown.asked)[1:]
            flown = flown._replace(cycle=flown.cycle._replace(memory=(own, line)))
        pairs = enumerate(zip(line[0], flown.asked, strict=True))
        return flown, [then - now if i in self.channels else 0.0 for i, (then, now) in pairs]
