"""Tables for a paper."""

from quadstep.report.publish import booktabs, escaped


def test_text_is_set_as_it_is():
    assert escaped("R_1 & 5 %") == r"R\_1 \& 5 \%"
    assert escaped("-3\u00a0\u00b5m, 30\u00b0, \u22121 <2") == r"-3~\textmu{}m, 30\textdegree{}, $-$1 $<$2"


def test_groups_are_set_apart_and_the_best_is_bold():
    text = booktabs(
        ("", "a_1", "b"), [[("calm", "1", "2")], [("wind", "3", "4"), ("load", "5", "6")]], ("100 %",), {(1, 0, 2)}
    )
    assert text.splitlines() == [
        r"% 100 \%",
        r"% needs \usepackage{booktabs}",
        r"\begin{tabular}{lrr}",
        r"\toprule",
        r" & a\_1 & b \\",
        r"\midrule",
        r"calm & 1 & 2 \\",
        r"\midrule",
        r"wind & 3 & \textbf{4} \\",
        r"load & 5 & 6 \\",
        r"\bottomrule",
        r"\end{tabular}",
    ]
