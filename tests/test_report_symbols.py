"""Names of the code as symbols: for figures, for HTML, and what stays as it is."""

import pytest
from matplotlib.mathtext import MathTextParser

from quadstep.report.units import label, power_of_ten, rich, typed


@pytest.mark.parametrize(("text", "html", "math"), [
    ("tau_psi", "τ<sub>ψ</sub>", "$τ_{ψ}$"),
    ("x_d - x", "x<sub>d</sub> − x", "$x_{d}$ − $x$"),
    ("K_r1 > m", "K<sub>r1</sub> &gt; m", r"$K_{\mathrm{r1}}$ > $m$"),
    ("L_dot", "L\u0307", r"$\dot{L}$"),
    ("x_d_dot", "x\u0307<sub>d</sub>", r"$\dot{x}_{d}$"),
    ("|W_tilde|", "|W\u0303|", r"|$\tilde{W}$|"),
    ("Lambda2 <b>", "Λ<sub>2</sub> &lt;b&gt;", "$Λ_{2}$ <$b$>"),
    ("J_M max(Lambda2)", "J<sub>M</sub> max(Λ<sub>2</sub>)", "$J_{M}$ max($Λ_{2}$)"),
    ("controller.K_r1, path.Lambda2", "controller.K_r1, path.Lambda2", "controller.K_r1, path.Lambda2"),
    ("norm of weights", "norm of weights", "norm of weights"),
    ("to 10 m", "to 10\u00a0m", "to 10 m"),
    ("27 um, 3 urad; um", "27\u00a0µm, 3\u00a0µrad; um", "27 µm, 3 µrad; um"),
    ("at 1 N m s, 2 N s/m", "at 1\u00a0N\u00a0m\u00a0s, 2\u00a0N\u00a0s/m", "at 1 N $m$ $s$, 2 N $s$/$m$"),
    ("$r$", "$r$", "$r$"),
    ("|r|^2", "|r|\u2060²", "|$r$|²"),
    ("C^T", "C<sup>T</sup>", "$C$^$T$"),
    ("2 l_2 sqrt(k_1 k_2)", "2 l<sub>2</sub> √(k<sub>1</sub> k<sub>2</sub>)", "2 $l_{2}$ √($k_{1}$ $k_{2}$)"),
    ("rad/s/sqrt(Hz)", "rad/s/√Hz", "rad/$s$/√Hz"),
    ("T1, T10", "T1, T10", "T1, T10"),
    ("pitch_d, pitch", "pitch<sub>d</sub>, pitch", r"$\mathrm{pitch}_{d}$, pitch"),
])  # fmt: skip
def test_names_are_set_as_symbols(text, html, math):
    assert rich(text) == html
    assert label(text) == math
    if "$" in math:
        MathTextParser("path").parse(math)  # Matplotlib understands it


@pytest.mark.parametrize(("text", "shown"), [
    ("tau_psi at most 2.3e-04 N m; t_f = 3 s", "τψ at most 2.3 × 10⁻⁴ N m; t_f = 3 s"),
    ("y 0.0e+00 m, 27 um (bound taken: 1e-6)", "y 0 m, 27 µm (bound taken: 10⁻⁶)"),
    ("tau_phi_a <b> & `x`", "τφ_a <b> & `x`"),
])  # fmt: skip
def test_in_a_terminal_greek_letters_and_powers_are_plain_text(text, shown):
    assert typed(text) == shown


def test_powers_of_ten():
    assert (power_of_ten(-6), power_of_ten(12)) == ("10⁻⁶", "10¹²")


@pytest.mark.parametrize(("text", "html"), [
    ("1.364e+05, 2.5e+07, 3.4e-06", "136,400, 2.5\u00a0×\u00a010⁷, 3.4\u00a0×\u00a010⁻⁶"),
    ("1e-06 to 1.0e-06", "10⁻⁶ to 1.0\u00a0×\u00a010⁻⁶"),
    ("see `quadstep linear`", "see <code>quadstep linear</code>"),
    ("-6.48e-06 to -2 [-3, 4]", "−6.48\u00a0×\u00a010⁻⁶ to −2 [−3, 4]"),
    ("a >= 2 and <= 3 +- 1", "a ≥ 2 and ≤ 3 ± 1"),
    ("95 % of 3 flights, 12 [11, 13] mm in 5 s, 2 m/s, 10^-6 m",
        "95\u00a0% of 3 flights, 12 [11, 13]\u00a0mm in 5\u00a0s, 2\u00a0m/s, 10⁻⁶\u00a0m"),
    ("2026-11-22, Case-1, 10-4, 0x1e5, --flight 3", "2026-11-22, Case-1, 10-4, 0x1e5, --flight 3"),
])  # fmt: skip
def test_numbers_are_written_as_people_do(text, html):
    assert rich(text) == html


def test_the_s_of_a_genitive_is_no_symbol():
    assert label("paper’s controller") == "paper’s controller"
