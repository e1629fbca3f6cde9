"""report.html of a certificate."""

from pathlib import Path

from quadstep.proofs.certify.certificate import FlightCertificate
from quadstep.proofs.certify.record import table
from quadstep.proofs.certify.verdict import answer, kind
from quadstep.report import page, units


def write_report(path: Path, c: FlightCertificate, name: str, verdict: str, figure: str) -> None:
    """Write it beside certificate.json. figure: its file, without ending."""
    shown = page.figure(
        path.parent / figure,
        "L and its rate, |r| and b_r, |W_tilde| and b_w, the term that the proof omits, and all terms of L_dot; the axes are "
        "logarithmic, those of rates on both sides of zero",
    )
    body = [
        page.summary(answer(c), facts(c), [shown]),
        page.heading("Measured values and bounds", "measured"),
        page.paragraph(f"Verdict: {verdict}."),
        page.table(("", "measured", "bound"), table(c)),
        page.note("Symbols follow the paper; as there, r mixes m/s and rad/s. All numbers, with units: certificate.json."),
    ]
    page.write_page(path, name, body, "Certificate")


def facts(c: FlightCertificate) -> list[page.Fact]:
    """What decides."""
    bound = f"b_r = {units.number(c.b_r)}" if c.b_r is not None else "b_r does not exist"
    return [
        page.Fact("verdict", kind(c), "on Theorem 5.1 for this flight"),
        page.Fact("K_min", units.number(c.conditions.k_min), "must be above 0"),
        page.Fact("largest |r|", units.number(float(c.r.max())), bound),
    ]
