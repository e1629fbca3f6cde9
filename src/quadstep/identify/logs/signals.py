"""Regressions and correlations of logged signals."""

from typing import NamedTuple

import numpy as np

from quadstep.identify.logs.flight import Flags, Floats


class LineFit(NamedTuple):
    """y = slope x by least squares. share: of y's variance that x explains. axis: the column of x that explains y best, and
    the slope on it alone.
    """

    slope: float
    share: float
    axis: int
    best: float
    best_share: float


class Lag(NamedTuple):
    """Lag of y behind x [s], its scatter between stretches of the log [s], and the correlation at that lag."""

    lag: float
    jitter: float
    correlation: float


def stretches(told: Flags) -> list[tuple[int, int]]:
    """Where flags (n,) are set: the first place of each stretch, and the one past its last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], told.astype(int), [0]])))
    return [(int(first), int(past)) for first, past in zip(edges[::2], edges[1::2], strict=True)]


def smooth(x: Floats, period: float, span: float = 0.08) -> Floats:
    """Two moving averages over `span` [s], centred."""
    count = max(1, round(span / period)) | 1
    box = np.ones(count) / count
    columns = [np.convolve(np.convolve(np.pad(one, count - 1, "edge"), box, "valid"), box, "valid") for one in x.T]
    result: Floats = np.stack(columns, axis=1)
    return result


def spectrum(x: Floats, period: float, count: int = 256) -> tuple[Floats, Floats]:
    """Frequencies [Hz] and amplitude densities, per sqrt(Hz), of the columns of x (n, columns), shape (frequencies, columns):
    means over Hann windows of `count` rows that overlap by half (Welch 1967).
    """
    count = min(count, len(x))
    window = np.hanning(count)[:, None]
    pieces = [x[first : first + count] for first in range(0, len(x) - count + 1, max(1, count // 2))]
    powers = [np.abs(np.fft.rfft((piece - piece.mean(axis=0)) * window, axis=0)) ** 2 for piece in pieces]
    density: Floats = np.sqrt(2.0 * period * np.mean(powers, axis=0) / float((window**2).sum()))
    frequencies: Floats = np.arange(len(density)) / (count * period)
    return frequencies[1:], density[1:]


def slopes(x: Floats, y: Floats, where: Flags) -> list[LineFit]:
    """For each column of y: its slope on the same column of x, and on the one that explains it best; means removed."""
    found = []
    for place in range(y.shape[1]):
        target = y[where, place] - y[where, place].mean()
        spread = float(target @ target) or 1.0
        shares, fits = [], []
        for column in x[where].T:
            known = column - column.mean()
            power = float(known @ known) or 1.0
            fit = float(known @ target) / power
            fits.append(fit)
            shares.append(fit * fit * power / spread)
        best = int(np.argmax(shares))
        found.append(LineFit(fits[place], shares[place], best, fits[best], shares[best]))
    return found


def lag(x: Floats, y: Floats, period: float, longest: float = 0.15) -> Lag | None:
    """Lag of y behind x, by the peak of their correlation over stretches of two seconds; None if there is no such stretch."""
    reach, size = round(longest / period), round(2.0 / period)
    found: list[tuple[float, float]] = []
    for first in range(reach, len(x) - size - reach, size):
        a = x[first : first + size] - x[first : first + size].mean()
        if a.std() < 1e-9:
            continue
        scores = []
        for shift in range(-reach, reach + 1):
            b = y[first + shift : first + shift + size]
            b = b - b.mean()
            scores.append(float(a @ b) / (float(np.sqrt((a @ a) * (b @ b))) or 1.0))
        best = int(np.argmax(scores))
        if 0 < best < 2 * reach and scores[best] > 0.6:
            left, middle, right = scores[best - 1 : best + 2]
            bend = left - 2.0 * middle + right
            found.append((best - reach + (0.5 * (left - right) / bend if bend else 0.0), middle))
    if len(found) < 3:
        return None
    lags = np.array([one for one, _ in found]) * period
    middle = float(np.median(lags))
    jitter = 1.4826 * float(np.median(np.abs(lags - middle)))
    return Lag(middle, jitter, float(np.median([score for _, score in found])))
