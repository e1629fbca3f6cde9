"""The plant behind a measured rate loop: a rigid body that the command turns after a lag and a delay, against its damping.

    rate / command = effect exp(-delay s) / ((s + damping) (1 + lag s))

Noise often drowns what the loop answers before its phase crosses -180 degrees. The log's parameters tell the controller, so
that the plant tells the loop at other frequencies and with other gains, as far as no resonance of the frame lies there.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from quadstep.identify.excited import Excited
from quadstep.identify.logs.flight import Floats
from quadstep.identify.measured import HiddenResonance, MeasuredLoop, measured
from quadstep.identify.response import Complex, Response, halves
from quadstep.io.errors import UserError

START, LAGS = np.array([100.0, 0.02, 0.003, 0.3]), (1.0, 0.5, 2.0)
"""Effect [rad/s^2], lag [s], delay [s] and damping [1/s] from which a fit starts, the effect as the response has it, and
factors on its lag: from one start, one fit of forty ends elsewhere than where the plant is; the best counts.
"""

ROUNDS, FIRM = 60, 1e-3
"""Most steps of a fit by Levenberg and Marquardt's method, and the damping of the first."""

MISFIT = 1.5
"""Mean square of what a plant leaves of the measured response, over its variance, from which on it does not explain it."""

BESIDE = 10.0
"""Factor by which the plant's frequencies go beyond those excited, on each side."""

ROUGH = 0.02
"""Standard deviation of the loop by the plant, as a share of it, that stays: the controller is taken without its samples."""

NARROW, NARROWEST = 0.01, 0.3
"""Width of the bands over which noise is averaged, as a share of their frequency, and the least [Hz]: a resonance damped by
1 % is twice as wide. Wider ones hide it, narrower ones are noise.
"""

TAPER, NEIGHBOURS = 0.05, 20
"""Share of the flight over which it fades in, and out, as the edges of a record would cover the noise; bands on either side of
one, with whose median it is compared: enough that a resonance damped by a tenth is less than half of them.
"""


class IdentifiedPlant(NamedTuple):
    """values: as `START`; spread (4, 4): their covariance; misfit: as `MISFIT`; loop: L at frequencies that reach beyond the
    excited ones, by the plant and the parameters in the log; hidden: `hidden_resonance`.
    """

    values: Floats
    spread: Floats
    misfit: float
    loop: Response
    hidden: HiddenResonance

    @property
    def explains(self) -> bool:
        return self.misfit < MISFIT

    @property
    def sentence(self) -> str:
        """The plant, in a sentence."""
        effect, lag, delay, _ = self.values
        if not self.explains:
            return (
                "A rigid body with a lag and a delay does not explain what was measured (the remainder is "
                f"{math.sqrt(self.misfit):.2g} times the noise), so it is not known how far the gains could rise."
            )
        return (
            f"A plant explains it: the whole command gives {effect:.3g} rad/s², with a lag of {1e3 * lag:.3g} ms and a delay "
            f"of {1e3 * delay:.3g} ms. It predicts the loop beyond what was excited, apart from "
            f"{self.hidden.words.removesuffix(',')}."
        )

    def as_json(self) -> dict[str, float]:
        names = "effect[rad/s^2]", "lag[s]", "delay[s]", "damping[1/s]"
        return {**dict(zip(names, self.values.tolist(), strict=True)), "misfit": self.misfit, "unseen_gain": self.hidden.gain}


def plant(flight: Excited) -> IdentifiedPlant | None:
    """None where the log does not tell what controls the plant."""
    loop, found = flight.loop, flight.measured
    if loop is None or loop.apart:  # the D part of Betaflight is not known
        return None
    reach = np.geomspace(found.omega[0] / BESIDE, found.omega[-1] * BESIDE, 400)

    def controller(s: Complex) -> Complex:
        return loop.controller(flight.parameters, s, flight.levelled)

    try:
        control, beyond = (controller(1j * omega.astype(np.complex128)) for omega in (found.omega, reach))
    except UserError:
        return None
    lines = found.omega * flight.period * len(flight.command) / (2.0 * np.pi)
    shared = np.maximum((2.0 * halves(lines) + 1.0) / np.gradient(lines), 1.0)  # by as many frequencies is each line used
    size = np.abs(found.sensitivity)
    heard = np.maximum(found.error**2 - (size * found.omega * found.late) ** 2, 0.0)  # `fitted` has the excitation's time
    weight = 1.0 / np.sqrt((heard + (ROUGH * size * np.abs(1.0 - found.sensitivity)) ** 2) * shared)
    starts = (START * np.array([1.0, factor, 1.0, 1.0]) for factor in LAGS)
    values, spread, rest = min((fitted(found, control, weight, start) for start in starts), key=lambda one: one[2])
    misfit = rest / max(2.0 * float((1.0 / shared).sum()) - len(START), 1.0)
    opened = beyond * turned(values, reach)
    sides = slopes(values, reach)
    parts = [np.einsum("ni,ij,nj->n", one, max(misfit, 1.0) * spread, one) for one in (sides.real, sides.imag)]
    sensitivity = 1.0 / (1.0 + opened)
    error = np.sqrt(np.maximum(*parts) + ROUGH**2) * np.abs(opened) * np.abs(sensitivity) ** 2
    freedom = np.full(len(reach), float(found.freedom.sum() / shared.mean()))
    whole = Response(reach, sensitivity, error, freedom, np.ones(len(reach)))
    return IdentifiedPlant(values, spread, misfit, whole, hidden_resonance(flight, controller, whole))


def loop_margins(flight: Excited) -> tuple[MeasuredLoop, IdentifiedPlant | None]:
    """As measured, or by the plant where the crossover was not excited; and the plant."""
    now, behind = measured(flight.measured), plant(flight)
    if now.phase is None and not now.open and behind and behind.explains:
        by_plant = measured(behind.loop)
        now = by_plant._replace(by_plant=True) if by_plant.phase else now
    return now._replace(hidden=behind and behind.hidden), behind


def hidden_resonance(flight: Excited, control: Callable[[Complex], Complex], loop: Response) -> HiddenResonance:
    """The largest |L| at -180 degrees that a resonance may have beyond what was excited, by the noise in the command; 1 where
    the log shows too little of it. control: of the command from the rate, at s; loop: without the resonance.

    Noise passes the loop times 1 / |1 + L|: at a resonance it stands by 1 / (1 - |L|) or more over what the loop without it
    leaves.
    """
    size = len(flight.command)
    omega = 2.0 * np.pi * np.fft.rfftfreq(size, flight.period)
    above = omega > flight.beyond
    omega = omega[above]
    width = np.maximum(NARROW * omega, 2.0 * np.pi * NARROWEST)
    bands = np.unique(np.floor(np.cumsum(2.0 * np.pi / (flight.period * size) / width)), return_inverse=True)[1]
    if not len(bands) or bands[-1] < 2 * NEIGHBOURS:
        return HiddenResonance(np.ones(2), np.array([flight.beyond, np.pi / flight.period]))
    count, sensitivity = np.bincount(bands), np.interp(omega, loop.omega, loop.sensitivity)
    middle, left = (np.bincount(bands, one) / count for one in (omega, np.abs(sensitivity)))
    ends = np.minimum(np.arange(size), np.arange(size)[::-1]) / (TAPER * size)
    fade = np.sin(0.5 * np.pi * np.minimum(ends, 1.0)) ** 2
    u, d = (np.fft.rfft(fade * (one - one.mean()))[above] for one in (flight.command, flight.excitation))
    made = np.abs(control(1j * middle.astype(np.complex128)) * left) ** 2
    noise = np.log(np.maximum(np.bincount(bands, np.abs(u - sensitivity * d) ** 2) / count, 1e-300) / made)
    around = np.pad(noise, NEIGHBOURS, "reflect", reflect_type="odd")
    stands = noise - np.median(np.lib.stride_tricks.sliding_window_view(around, 2 * NEIGHBOURS + 1), axis=1)
    return HiddenResonance(1.0 - np.exp(-0.5 * np.maximum(stands, 0.0)), middle)


def turned(values: Floats, omega: Floats) -> Complex:
    """The rate that a command makes, at frequencies [rad/s] (n,)."""
    effect, lag, delay, damping = values
    s = 1j * omega
    return effect * np.exp(-delay * s) / ((s + damping) * (1.0 + lag * s))


def slopes(values: Floats, omega: Floats) -> Complex:
    """Of its logarithm along the values (n, 4)."""
    effect, lag, _, damping = values
    s = 1j * omega
    return np.stack([1.0 / effect + 0.0 * s, -s / (1.0 + lag * s), -s, -1.0 / (s + damping)], axis=1)


def fitted(response: Response, control: Complex, weight: Floats, start: Floats) -> tuple[Floats, Floats, float]:
    """Values, their covariance, and the weighted squares that are left of the sensitivity, whose errors are normal. How late
    the excitation is is fitted too: where the loop no longer answers, the command is the excitation.
    """
    late = max(response.late, 1e-9)

    def left(values: Floats) -> tuple[Complex, float]:
        shift = np.exp(-1j * values[-1] * response.omega)
        rest = (response.sensitivity - shift / (1.0 + control * turned(values[:-1], response.omega))) * weight
        return rest, float((np.abs(rest) ** 2).sum() + (values[-1] / late) ** 2)

    scale = float(np.median(np.abs(response.opened / (control * turned(start, response.omega)))))
    values, least = np.array([start[0] * scale, *start[1:], 0.0]), [1e-3 * start[0] * scale, 0.0, 0.0, 0.0, -np.inf]
    rest, cost = left(values)
    firm = FIRM
    for _ in range(ROUNDS):
        opened = control * turned(values[:-1], response.omega)
        moves = -opened[:, None] / (1.0 + opened[:, None]) * slopes(values[:-1], response.omega)
        shifted = np.exp(-1j * values[-1] * response.omega) / (1.0 + opened) * weight
        moves = np.concatenate([moves, -1j * response.omega[:, None]], axis=1) * shifted[:, None]
        prior = np.array([[0.0, 0.0, 0.0, 0.0, 1.0 / late]])
        matrix = np.concatenate([moves.real, moves.imag, prior])
        square = matrix.T @ matrix
        pull = matrix.T @ np.concatenate([rest.real, rest.imag, [-values[-1] / late]])
        then = np.maximum(values + np.linalg.pinv(square + firm * np.diag(np.diag(square))) @ pull, least)
        other, less = left(then)
        if not less <= cost:
            firm *= 5.0
            continue
        close = cost - less < 1e-9 * cost
        values, rest, cost, firm = then, other, less, firm / 5.0
        if close:
            break
    return values[:-1], np.linalg.pinv(square)[:-1, :-1], cost
