"""The response with one channel opened: the lifted transfer of the sampled loop at a frequency.

With additions to the channel's command at each sample of the law in a period as input, d, and the commands themselves as
output, c, the closed loop is c = T(z) d, a square matrix where the law runs several times a period (Bittanti and Colaneri,
"Periodic Systems", 2009, chapter 6: lifting). A factor f on the channel is d = (f - 1) c, and moves a pole to z on the unit
circle where 1 / (f - 1) is an eigenvalue of T(z). So with -L = T / (1 + T) for each eigenvalue, f = -1 / L is critical, as
in Nyquist's criterion, and nothing in the loop is approximated.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.linear.modes import Modes, ReducedPeriod
from quadstep.linear.sampled import product
from quadstep.linear.states import Array

Complex = NDArray[np.complex128]

POINTS = 300
LOWEST = 1e-3
"""Lowest frequency [rad/s]."""

ALIKE = 1e-5
"""Frequencies that differ by less than this share count as one."""

FEW = 20
"""Most samples of the law in a period for which all values at a frequency are computed; of more, single ones are followed."""

SLOW, TERMS, EXACT = 0.4, 40, 1e-9
"""Least factor of a mode that counts by itself, terms of the series of the others, and the largest relative error of both."""

NEWTON, CLOSE = 12, 1e-13
"""Steps of inverse iteration, and the largest change of the value by the last, relative to 1."""


class Modal(NamedTuple):
    """T on the unit circle as a sum over modes, and of what is gone within a few periods as a power series in 1 / z.

    factors: of the modes. felt: how they show in the commands, shape (channels, samples, modes); driven: how they follow from
    the ticks, shape (channels, modes, ticks). fading: of all other modes, whose factors are smaller than `SLOW`: terms from
    1 / z on, shape (terms, channels, samples, ticks).
    """

    factors: Complex
    felt: Complex
    driven: Complex
    fading: Array


@dataclass(frozen=True)
class OpenedLoop:
    """The channels, each to be opened. a: map of a period of the closed loop, shape (n, n). b: from what is added to a command
    during each tick, shape (channels, n, ticks); c: to the command at each sample of the law, shape (channels, samples, n);
    d: straight through, shape (channels, samples, ticks). due: ticks at which the law samples. step: of the integrator [s].
    modal: where that is exact enough.
    """

    a: Array
    b: Array
    c: Array
    d: Array
    due: tuple[int, ...]
    step: float
    modal: Modal | None = None

    @property
    def ticks(self) -> int:
        """Samples of the law in a period."""
        return int(self.d.shape[2])

    @property
    def length(self) -> float:
        """Length of a period [s]."""
        return self.ticks * self.step

    @property
    def hold(self) -> Array:
        """How the ticks follow from the samples of the law, shape (ticks, samples)."""
        return hold(self.due, self.ticks)

    @cached_property
    def by_sample(self) -> "OpenedLoop":
        """From what is added to each sample of the law, which is held until the next."""
        onto, of = self.hold, self.modal
        modal = of and of._replace(driven=of.driven @ onto, fading=of.fading @ onto)
        return replace(self, b=self.b @ onto, d=self.d @ onto, modal=modal)

    def only(self, channel: int) -> "OpenedLoop":
        own = slice(channel, channel + 1)
        of = self.modal
        modal = of and Modal(of.factors, of.felt[own], of.driven[own], of.fading[:, own])
        return replace(self, b=self.b[own], c=self.c[own], d=self.d[own], modal=modal)


def hold(due: Sequence[int], ticks: int) -> Array:
    """How the ticks follow from the samples, shape (ticks, samples): each is held until the next."""
    latest = np.searchsorted(due, np.arange(ticks), side="right") - 1
    return (latest[:, None] == np.arange(len(due))).astype(np.float64)


def opened(loop: ReducedPeriod) -> OpenedLoop:
    """The loop with each channel ready to be opened."""
    period, count, channels = loop.period, len(loop.period.names), len(loop.commands)
    ticks = len(period.ticks)
    whole, added = np.eye(count), np.zeros((count, ticks, channels))
    rows: list[Array] = []
    through: list[Array] = []
    due: list[int] = []
    for k, tick in enumerate(period.ticks):
        whole, added = product(tick.tasks, whole), product(tick.tasks, added)
        if tick.sampled:
            due.append(k)
            rows.append(whole[loop.commands])
            through.append(added[loop.commands, :, np.arange(channels)])
        added[:, k] += tick.acting
        whole, added = product(tick.step, whole), product(tick.step, added)
        added[:, k] -= tick.acting
    c, d = np.array(rows).transpose(1, 0, 2), np.array(through).transpose(1, 0, 2)
    return with_modes(OpenedLoop(whole, added.transpose(2, 0, 1), c, d, tuple(due), period.step), loop.modes)


def with_modes(one: OpenedLoop, modes: Modes) -> OpenedLoop:
    """The same by the modes of its map, in balanced coordinates and back; as it is where they are too close to one another."""
    others, left = np.linalg.eig(modes.balanced.T)
    slow, same = np.abs(modes.factors) >= SLOW, np.abs(others) >= SLOW
    if slow.sum() != same.sum():
        return one
    right, left = modes.vectors[:, slow], left[:, same].T
    try:
        left = np.linalg.solve(left @ right, left)
    except np.linalg.LinAlgError:
        return one
    units, fading = modes.units, []
    left_over = one.b - units[:, None] * ((right @ left).real @ (one.b / units[:, None]))
    for _ in range(TERMS):
        fading.append(one.c @ left_over)
        if np.abs(fading[-1]).max() < 1e-16 * np.abs(one.d).max(initial=1.0):
            break
        left_over = one.a @ left_over
    felt, driven = one.c @ (units[:, None] * right), (left / units) @ one.b
    found = replace(one, modal=Modal(modes.factors[slow], complex_(felt), complex_(driven), np.array(fading)))
    tried, exact = (transfer(way, np.array([1e-2, 0.3, 1.7, 3.1]) / one.length) for way in (found, one))
    off, size = np.abs(tried - exact).max(axis=(0, 2, 3)), np.abs(exact).max(axis=(0, 2, 3))
    return found if (off <= EXACT * size).all() else one


def complex_(values: Array | Complex) -> Complex:
    return values.astype(np.complex128)


def frequencies(loop: ReducedPeriod) -> Array:
    """Frequencies up to half of a period's sampling rate [rad/s]: logarithmically spaced, and around the closed loop's poles.

    Each frequency stands for as many as the law has samples in a period; the more there are, the fewer are needed.
    """
    highest = np.pi / loop.period.length
    samples = sum(tick.sampled for tick in loop.period.ticks)
    points, beside, alike = (POINTS, 9, ALIKE) if samples <= FEW else (POINTS // 10, 3, 0.01)
    poles = loop.modes.factors
    poles = poles[np.abs(poles) > 1e-6]
    s = np.log(poles.astype(complex)) / loop.period.length
    near = np.abs(s.imag)[:, None] + np.abs(s.real)[:, None] * np.linspace(-2.0, 2.0, beside)
    every: Array = np.concatenate(
        [np.geomspace(LOWEST, highest, points), np.linspace(0.0, highest, points // 4)[1:], near.ravel()]
    )
    every = np.sort(every[(every >= LOWEST) & (every <= highest)])
    return every[np.append(np.diff(every) > alike * every[1:], True)]


def transfer(one: OpenedLoop, omega: Array, onto: Array | Complex | None = None) -> Complex:
    """T of each channel at these frequencies [rad/s], shape (frequencies, channels, samples, samples).

    onto: how the ticks of a period follow from its inputs, shape (ticks, inputs); default: from the held samples of the law.
    """
    points = np.exp(1j * np.asarray(omega) * one.length)
    if onto is None:
        one = one.by_sample
    if one.modal is None:
        unit = np.eye(len(one.a))
        through = np.array([one.c @ np.linalg.solve(point * unit - one.a, one.b) + one.d for point in points])
    else:
        factors, felt, driven, fading = one.modal
        weights = 1.0 / (points[:, None] - factors)
        powers = points[:, None] ** -np.arange(1.0, len(fading) + 1.0)
        through = (felt * weights[:, None, None, :]) @ driven + np.tensordot(powers, fading, 1) + one.d
    return complex_(through if onto is None else through @ onto)


def loci(one: OpenedLoop, omega: Array) -> Complex:
    """-L of each channel, shape (frequencies, channels, samples): its values unordered if the law runs several times."""
    return closed_response(np.linalg.eigvals(transfer(one, omega)).astype(np.complex128))


def loci_near(one: OpenedLoop, omega: Array, g: complex) -> Complex:
    """-L of a single channel, shape (frequencies, values): all values or, if there are many, the one followed from g."""
    if len(one.due) <= FEW:
        return loci(one, omega)[:, 0]
    found, turned = [], g / (1.0 - g)
    for through in transfer(one, omega)[:, 0]:
        turned = eigenvalue_near(through, turned)
        found.append([turned])
    return closed_response(np.array(found))


def mode_frequency(one: OpenedLoop, omega: float, g: complex) -> float:
    """The frequency [rad/s] at which the law's samples oscillate in the mode of a single channel's g: over a whole period all
    frequencies that differ by whole turns are the same.
    """
    matrix, turned = transfer(one, np.array([omega]))[0, 0], g / (1.0 - g)
    _, swing = mode_near(matrix, turned)
    most = -(-len(one.due) // 2)
    every = omega + 2.0 * np.pi / one.length * np.array(sorted(range(-most, most + 1), key=abs))
    waves = np.exp(1j * one.step * np.outer(every, one.due))
    return float(every[np.argmax(np.round(np.abs(waves.conj() @ swing), 9))])


def closed_response(turned: Complex) -> Complex:
    with np.errstate(all="ignore"):
        return np.nan_to_num(turned / (1.0 + turned))


def eigenvalue_near(matrix: Complex, value: complex) -> complex:
    """The eigenvalue of a matrix nearest to a value; small matrices: all are compared."""
    if len(matrix) > FEW:
        return mode_near(matrix, value)[0]
    values = np.linalg.eigvals(matrix)
    return complex(values[np.argmin(np.abs(values - value))])


def mode_near(matrix: Complex, value: complex) -> tuple[complex, Complex]:
    """The eigenvalue of a matrix nearest to a value, and its vector, by inverse iteration."""
    unit, vector = np.eye(len(matrix)), np.ones(len(matrix), dtype=complex)
    for step in range(NEWTON):
        try:
            solved = np.linalg.solve(matrix - value * unit, vector)
        except np.linalg.LinAlgError:  # it is an eigenvalue
            break
        change = np.vdot(solved, vector) / np.vdot(solved, solved)
        vector = solved / np.linalg.norm(solved)
        if step:  # the first step only rotates the vector
            value += complex(change)
            if abs(change) < CLOSE * (1.0 + abs(value)):
                break
    return value, vector


def harmonic(one: OpenedLoop, omega: Array) -> Complex:
    """L of each channel at these frequencies, up to half the law's rate, shape (frequencies, channels): among the values of L,
    the one whose eigenvector is nearest to the samples of exp(i omega t).
    """
    made: Complex = np.empty((len(omega), len(one.d)), dtype=complex)
    for i, matrices in enumerate(transfer(one, omega)):
        wave = np.exp(1j * omega[i] * one.step * np.array(one.due))
        values, vectors = np.linalg.eig(matrices)
        nearest = np.abs(np.einsum("s,csk->ck", wave.conj(), vectors)).argmax(axis=1)
        turned = values[np.arange(len(values)), nearest]
        made[i] = -turned / (1.0 + turned)
    return made
