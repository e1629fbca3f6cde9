"""A page with real flights beside simulated ones: what was wanted, what was flown, what the simulation flew."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from quadstep.atomic import write_beside
from quadstep.identify.closed_loop import Beside, Tracking
from quadstep.logs.flight import Floats
from quadstep.report.page import heading, page_text, paragraph, table

WIDE, HIGH, LEFT, POINTS = 960.0, 150.0, 60.0, 800
COLOURS = {"setpoint": "#999999", "real": "#0072b2", "simulated": "#d55e00"}
"""Told apart by people who see fewer colours too (Okabe and Ito 2008)."""


def write(path: Path, found: Sequence[Beside], controller: str) -> None:
    """Write the page. Raises UserError."""
    parts = [
        paragraph(f"Logged setpoints flown again under {controller}, from the measured state on."),
        paragraph("Grey: setpoint. Blue: the real flight. Orange: the simulated one."),
    ]
    for one in found:
        parts.append(heading(one.name, one.name))
        if one.lost:
            parts.append(paragraph(f"The simulated flight ended: {one.lost}."))
        rows = [(who, *numbers(tracking)) for who, tracking in (("real", one.real), ("simulated", one.simulated))]
        parts.append(table(("", "RMSE [cm]", "lead [ms]", "tilt, 99 % [deg]", "mean rate [rad/s]"), rows))
        for axis, name in enumerate("xyz"):
            lines = {"setpoint": one.setpoint, "real": one.real_position, "simulated": one.flown_position}
            parts.append(drawn(f"{name} [m]", one.time, {key: values[:, axis] for key, values in lines.items()}))
    write_beside(path, page_text("Real and simulated flights", parts))


def numbers(one: Tracking) -> tuple[str, str, str, str]:
    """How a flight follows its setpoints, as text."""
    return f"{100 * one.rmse:.1f}", f"{1e3 * one.lead:.0f}", f"{np.degrees(one.tilt):.1f}", f"{one.rate:.2f}"


def drawn(name: str, time: Floats, lines: dict[str, Floats]) -> str:
    """A panel of lines over time, as inline SVG."""
    every = max(1, len(time) // POINTS)
    values = np.concatenate(list(lines.values()))
    low, high = float(values.min()), float(values.max())
    span = max(high - low, 0.1)

    def place(x: Floats, y: Floats) -> str:
        across = LEFT + (WIDE - LEFT) * (x - time[0]) / max(float(time[-1] - time[0]), 1e-9)
        down = 10.0 + (HIGH - 35.0) * (high - y) / span
        return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across, down, strict=True))

    shapes = [
        f'<polyline fill="none" stroke="{COLOURS[key]}" stroke-width="1.6" points="{place(time[::every], line[::every])}"/>'
        for key, line in lines.items()
    ]
    labels = [
        f'<text x="2" y="18">{high:.2f}</text>',
        f'<text x="2" y="{HIGH - 26:.0f}">{high - span:.2f}</text>',
        f'<text x="2" y="{HIGH / 2 - 4:.0f}">{name}</text>',
        f'<text x="{LEFT:.0f}" y="{HIGH - 4:.0f}">0 s</text>',
        f'<text x="{WIDE - 4:.0f}" y="{HIGH - 4:.0f}" text-anchor="end">{time[-1]:.1f} s</text>',
    ]
    inside = "".join([*shapes, *labels])
    box = f'viewBox="0 0 {WIDE:.0f} {HIGH:.0f}" font-family="sans-serif" font-size="13" fill="#222"'
    drawing = f'<svg xmlns="http://www.w3.org/2000/svg" {box}>{inside}</svg>'
    return f'<figure role="img" aria-label="{name} over time">{drawing}</figure>'
