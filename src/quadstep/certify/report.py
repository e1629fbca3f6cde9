"""report.html of a certificate."""

from pathlib import Path

from quadstep.certify.certificate import Certificate
from quadstep.certify.record import table
from quadstep.certify.verdict import kind
from quadstep.report import page, units


def write_report(path: Path, c: Certificate, name: str, verdict: str, figure: str) -> None:
    """Write it beside certificate.json. figure: its file, without ending."""
    shown = page.figure(
        path.parent / figure,
        "L and its rate, |r| against b_r, |W_tilde| against b_w, and the term that the proof leaves out; all axes logarithmic",
    )
    body = [
        page.summary(f"{verdict[0].upper()}{verdict[1:]}.", facts(c), [shown]),
        page.heading("Measured, and held against", "measured"),
        page.table(("", "measured", "against"), table(c)),
        page.note("Symbols are the paper's; r mixes m/s and rad/s as it does. All numbers, with units: certificate.json."),
    ]
    page.write_page(path, name, body, "Certificate")


def facts(c: Certificate) -> list[page.Fact]:
    """What decides."""
    bound = f"b_r = {units.number(c.b_r)}" if c.b_r is not None else "there is no b_r"
    return [
        page.Fact("the finding", kind(c), "of Theorem 5.1 on this flight"),
        page.Fact("K_min", units.number(c.conditions.k_min), "must be above 0"),
        page.Fact("largest |r|", units.number(float(c.r.max())), bound),
    ]
