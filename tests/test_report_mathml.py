"""Formulas as MathML: what each piece of LaTeX becomes, what is refused, and that every page's formulas are understood."""

import re
from xml.etree import ElementTree

import pytest

from docs.site.pages import name_of, pages
from quadstep.proofs.verify.registry import all_rows
from quadstep.report.mathml import SOURCE, THIN, displayed, dollars, mathml, typeset

CHILDREN = {"msub": 2, "msup": 2, "mover": 2, "mfrac": 2, "msubsup": 3, "munderover": 3}
"""Of elements that a browser shows as a mere row where they have more."""

FENCED = re.compile(r"^```.*?^```|^ {4}.*?$|`[^`\n]*`|<!--.*?-->", re.DOTALL | re.MULTILINE)


def inside(latex):
    """A formula without the frame that all have."""
    return re.sub(r"</?math[^>]*>|</?semantics>|<annotation.*</annotation>", "", mathml(latex)).removeprefix("<mrow>")[:-7]


@pytest.mark.parametrize(
    ("latex", "made"),
    [
        ("x", "<mi>x</mi>"),
        ("-12.5", '<mo form="prefix">−</mo><mn>12.5</mn>'),
        ("a - b", "<mi>a</mi><mo>−</mo><mi>b</mi>"),
        (r"a \sin b", f"<mi>a</mi>{THIN}<mi>sin</mi><mo>&#8289;</mo>{THIN}<mi>b</mi>"),
        (r"\cos^2 b", f"<msup><mi>cos</mi><mrow><mn>2</mn></mrow></msup><mo>&#8289;</mo>{THIN}<mi>b</mi>"),
        (r"\sin(b)", '<mi>sin</mi><mo>&#8289;</mo><mo stretchy="false">(</mo><mi>b</mi><mo stretchy="false">)</mo>'),
        (r"\Lambda_1", '<msub><mi mathvariant="normal">Λ</mi><mn>1</mn></msub>'),
        ("K_{r1}", "<msub><mi>K</mi><mrow><mi>r</mi><mn>1</mn></mrow></msub>"),
        ("x_d^2", "<msubsup><mi>x</mi><mi>d</mi><mrow><mn>2</mn></mrow></msubsup>"),
        ("f'", '<mrow><mi>f</mi><mo lspace="0" rspace="0">′</mo></mrow>'),
        (r"\dot e_1", '<msub><mover accent="true"><mi>e</mi><mo stretchy="false">˙</mo></mover><mn>1</mn></msub>'),
        (r"\frac{1}{2}", "<mfrac><mrow><mn>1</mn></mrow><mrow><mn>2</mn></mrow></mfrac>"),
        (r"\tfrac12 x", '<mfrac displaystyle="false"><mn>1</mn><mn>2</mn></mfrac><mi>x</mi>'),
        (
            r"\hat W^T",  # the superscript as high as beside W alone
            '<msup><mpadded height="0.66em"><mover accent="true"><mi>W</mi><mo stretchy="false">ˆ</mo></mover></mpadded>'
            "<mrow><mi>T</mi></mrow></msup>",
        ),
        (  # the subscript as low as beside a letter that does not descend
            r"\eta_d",
            '<msub><mpadded depth="0"><mi>η</mi></mpadded><mi>d</mi></msub>',
        ),
        (r"\sqrt N", "<msqrt><mi>N</mi></msqrt>"),
        (r"\text{if } a < b", "<mtext>if </mtext><mi>a</mi><mo>&lt;</mo><mi>b</mi>"),
        (r"\class{s-r}{r}", '<mrow class="s-r"><mrow><mi>r</mi></mrow></mrow>'),
    ],
)
def test_what_each_piece_becomes(latex, made):
    assert inside(latex) == made


def test_a_matrix_has_its_rows_and_columns():
    found = ElementTree.fromstring(mathml(r"\begin{bmatrix} a & b \\ c & d \\ \end{bmatrix}"))
    assert [[len(cell) for cell in row] for row in found.iter("mtr")] == [[1, 1], [1, 1]]
    assert [one.text for one in found.iter("mo")] == ["[", "]"]


@pytest.mark.parametrize(
    "latex", [r"\unknown x", "{x", "x}", r"\left( x", r"\begin{bmatrix} a", r"\begin{tabular} a \end{tabular}", "x^", "a & b"]
)
def test_what_is_not_understood_is_refused_with_the_formula(latex):
    with pytest.raises(ValueError, match=r"in the formula"):
        mathml(latex)


def test_a_number_stands_at_the_right_and_not_in_the_formula():
    found = displayed(r"a = b \tag{T16}")
    assert found.endswith('<span class="tag">(T16)</span></div>')
    assert "tag{" not in found


def test_text_around_formulas_is_escaped_and_their_source_stays_inside():
    assert typeset("a & b") == "a &amp; b"
    assert typeset("$x$'s, too") == f"""<span style="white-space:nowrap">{mathml("x")}&#x27;</span>s, too"""
    found = typeset("<$x<1$>")
    assert found.startswith("&lt;<math>")
    assert found.endswith("</math>&gt;")
    assert '<annotation encoding="application/x-tex">x&lt;1</annotation>' in found


@pytest.mark.parametrize("page", pages(), ids=name_of)
def test_every_formula_of_a_page_is_understood_and_well_formed(page):
    text = FENCED.sub("", page.read_text(encoding="utf-8"))
    assert text.replace("$$", "").count("$") % 2 == 0
    for found in SOURCE.finditer(text):
        made = ElementTree.fromstring(mathml(found[1] or found[2], block=bool(found[1])))
        for kind, count in CHILDREN.items():
            assert all(len(one) == count for one in made.iter(kind)), found[0]


@pytest.mark.parametrize(("text", "latex"), [
    ("m r1_dot is off, a force", r"$m \dot{r}_{1}$ is off, a force"),
    ("|e1| <= sup|r1| / sigma_min", r"$\lvert e_{1}\rvert$ $\le \sup\lvert r_{1}\rvert  / \sigma_{\min}$"),
    ("b = sqrt(f_y^2 + f_z^2), 0.98 N off", r"$b = \sqrt{f_{y}^{2} + f_{z}^{2}}$, 0.98 N off"),
    ("(Eq. 3) with T_eta's tau_psi = (1, -2) N m", r"(Eq. 3) with $T_{\eta}$'s $\tau_{\psi} = (1, -2)$ N m"),
    ("`quadstep.control` at 5 rad/s^2 [m/s]", "`quadstep.control` at 5 rad/s² [m/s]"),
])  # fmt: skip
def test_formulas_as_in_code_are_set_off(text, latex):
    assert dollars(text) == latex


def test_every_formula_of_the_errata_is_typeset():
    for row in all_rows():
        for cell in (row.number, row.printed, row.reason):
            text = SOURCE.sub("", dollars(cell))
            assert not re.search(r"[_^=<>|]|\b(?:eta|theta|phi|psi|tau|delta|kappa|[a-zA-Z]\d)\b", text), cell
            typeset(dollars(cell))
