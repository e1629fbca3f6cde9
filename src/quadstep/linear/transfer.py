"""What comes back where one channel is opened: the lifted transfer of the sampled loop at a frequency.

With what is added to the channel's command at each sample of the law in a period as input, d, and the commands themselves as
output, c, the closed loop is c = T(z) d, a square matrix where the law runs several times a period (Bittanti and Colaneri,
"Periodic Systems", 2009, chapter 6: lifting). A factor f on the channel is d = (f - 1) c, and moves a pole to z on the unit
circle where 1 / (f - 1) is an eigenvalue of T(z). So with -L = T / (1 + T) for each eigenvalue, f = -1 / L is critical, as
Nyquist has it, and nothing of the loop is approximated.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadstep.linear.reduced import Reduced
from quadstep.linear.sampled import Array

Complex = NDArray[np.complex128]

POINTS = 300
LOWEST = 1e-3
"""Of the frequencies [rad/s]."""


class Opened(NamedTuple):
    """The channels, each to be opened. a: map of a period of the closed loop, shape (n, n). b: from what is added to a command
    during each tick, shape (channels, n, ticks); c: to the command at each sample of the law, shape (channels, samples, n); d:
    straight through, shape (channels, samples, ticks). due: ticks at which the law samples. step: of the integrator [s].
    """

    a: Array
    b: Array
    c: Array
    d: Array
    due: tuple[int, ...]
    step: float

    @property
    def ticks(self) -> int:
        """In a period."""
        return int(self.d.shape[2])

    @property
    def length(self) -> float:
        """Of a period [s]."""
        return self.ticks * self.step

    @property
    def hold(self) -> Array:
        """What each sample of the law makes of the ticks, shape (ticks, samples): it is held."""
        latest = np.searchsorted(self.due, np.arange(self.ticks), side="right") - 1
        held: Array = (latest[:, None] == np.arange(len(self.due))).astype(np.float64)
        return held

    def only(self, channel: int) -> "Opened":
        """One of them."""
        own = slice(channel, channel + 1)
        return self._replace(b=self.b[own], c=self.c[own], d=self.d[own])


def opened(loop: Reduced) -> Opened:
    """The loop with each channel ready to be opened."""
    period, count, channels = loop.period, len(loop.period.names), len(loop.commands)
    ticks = len(period.ticks)
    whole, added = np.eye(count), np.zeros((count, ticks, channels))
    rows: list[Array] = []
    through: list[Array] = []
    due: list[int] = []
    for k, tick in enumerate(period.ticks):
        whole, added = tick.tasks @ whole, np.tensordot(tick.tasks, added, 1)
        if tick.sampled:
            due.append(k)
            rows.append(whole[loop.commands])
            through.append(added[loop.commands, :, np.arange(channels)])
        added[:, k] += tick.acting
        whole, added = tick.step @ whole, np.tensordot(tick.step, added, 1)
        added[:, k] -= tick.acting
    c, d = np.array(rows).transpose(1, 0, 2), np.array(through).transpose(1, 0, 2)
    return Opened(whole, added.transpose(2, 0, 1), c, d, tuple(due), period.step)


def frequencies(loop: Reduced) -> Array:
    """Up to half of a period's sampling rate [rad/s]: evenly in the logarithm, and around the poles of the closed loop."""
    highest = np.pi / loop.period.length
    poles = np.linalg.eigvals(loop.map)
    poles = poles[np.abs(poles) > 1e-6]
    s = np.log(poles.astype(complex)) / loop.period.length
    near = np.abs(s.imag)[:, None] + np.abs(s.real)[:, None] * np.linspace(-2.0, 2.0, 9)
    every: Array = np.concatenate(
        [np.geomspace(LOWEST, highest, POINTS), np.linspace(0.0, highest, POINTS // 4)[1:], near.ravel()]
    )
    return np.unique(every[(every >= LOWEST) & (every <= highest)])


def transfer(one: Opened, omega: Array, onto: Array | Complex | None = None) -> Complex:
    """T of each channel at these frequencies [rad/s], shape (frequencies, channels, samples, samples).

    onto: how the ticks of a period follow from its inputs, shape (ticks, inputs), if not from the law's samples that are held.
    """
    spread: Array | Complex = one.hold if onto is None else onto
    channels, samples, _ = one.d.shape
    b, d = one.b @ spread, one.d @ spread
    inputs, unit = spread.shape[1], np.eye(len(one.a))
    columns = b.transpose(1, 0, 2).reshape(len(one.a), channels * inputs)
    made: Complex = np.empty((len(omega), channels, samples, inputs), dtype=complex)
    for i, point in enumerate(np.exp(1j * np.asarray(omega) * one.length)):
        moved = np.linalg.solve(point * unit - one.a, columns).reshape(-1, channels, inputs).transpose(1, 0, 2)
        made[i] = one.c @ moved + d
    return made


def loci(one: Opened, omega: Array) -> Complex:
    """-L of each channel, shape (frequencies, channels, samples): its values in no order where the law runs several times."""
    turned = np.linalg.eigvals(transfer(one, omega))
    with np.errstate(all="ignore"):
        return np.nan_to_num(turned / (1.0 + turned))


def harmonic(one: Opened, omega: Array) -> Complex:
    """L of each channel at these frequencies, up to half the law's rate, shape (frequencies, channels): of the values of L the
    one whose eigenvector is nearest to the samples of exp(i omega t).
    """
    made: Complex = np.empty((len(omega), len(one.d)), dtype=complex)
    for i, matrices in enumerate(transfer(one, omega)):
        wave = np.exp(1j * omega[i] * one.step * np.array(one.due))
        values, vectors = np.linalg.eig(matrices)
        nearest = np.abs(np.einsum("s,csk->ck", wave.conj(), vectors)).argmax(axis=1)
        turned = values[np.arange(len(values)), nearest]
        made[i] = -turned / (1.0 + turned)
    return made
