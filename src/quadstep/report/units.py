"""Names as the code writes them, set as the field writes them: tau_psi as a Greek letter with a Greek subscript.

Numbers as people write them: a unit that suits the size, digits that mean something, intervals.
"""

import math
import re
from collections.abc import Callable, Sequence
from html import escape

GREEK = {
    "psi": "ψ", "theta": "θ", "phi": "φ", "tau": "τ", "kappa": "κ", "sigma": "σ", "xi": "ξ", "eta": "η", "omega": "ω",
    "delta": "δ", "eps": "ε", "mu": "µ", "Lambda": "Λ", "Omega": "Ω", "Gamma": "Γ", "Sigma": "Σ",
}  # fmt: skip
ACCENTS = {"dot": ("dot", "\u0307"), "ddot": ("ddot", "\u0308"), "tilde": ("tilde", "\u0303"), "hat": ("hat", "\u0302")}
"""Of a name: as a command of TeX, as a combining character."""

AXES = frozenset(("roll", "pitch", "yaw"))
"""Words that are symbols where something stands below them."""

NAME = re.compile(r"(?<![\w.])(?!T\d\b)([^\W\d_]+)(\d?)((?:_[^\W_]+)*)(?![\w]|\.\w)")
"""A letter or word, perhaps a digit, perhaps parts after underscores; nothing with dots, which are keys of files, and no
number of a statement (T1 to T16)."""

UNITS = frozenset(("m", "s", "N", "J", "W", "V", "g"))
MEASURE = re.compile(
    r"(?<=[\d\]∞⁰¹²³⁴⁵⁶⁷⁸⁹]) (?=(?:%|[nµmkMG]?(?:m|s|g|N|J|W|V|Hz|rad)[²³]?)(?![\w²³]))"
    r"|(?<=\bN) (?=[ms]\b)|(?<=\bN m) (?=s\b)|(?<=\d\skg) (?=m²)|(?<=^&[gl]t;) (?=\d)"
)
"""The space before a unit, or within that of a torque or inertia, or behind the > or < that a table's cell begins with."""

POWERS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def name_parts(match: re.Match[str], letters: bool) -> tuple[str, list[str], list[str]] | None:
    """Letter, accents and subscripts of a name, None if it is a word. letters: whether one letter alone is a symbol."""
    name, digit, tail = match.groups()
    low = [one for one in (digit, *tail.split("_")) if one]
    is_symbol = name in GREEK or (len(name) == 1 and (letters or bool(low))) or (name in AXES and bool(low))
    if not is_symbol:
        return None
    return GREEK.get(name, name), [one for one in low if one in ACCENTS], [one for one in low if one not in ACCENTS]


def label(text: str) -> str:
    """For Matplotlib's mathtext: every name, and every single letter, set as a symbol."""

    def symbol(match: re.Match[str]) -> str:
        found, before = name_parts(match, letters=True), text[: match.start()].rstrip()[-1:]
        if found is None or before == "’" or (match[0] in UNITS and before.isdigit()):
            return match[0]
        letter, accents, low = found
        if letter in AXES:
            letter = rf"\mathrm{{{letter}}}"
        for accent in accents:
            letter = rf"\{ACCENTS[accent][0]}{{{letter}}}"
        below = ",".join(GREEK.get(one, one if len(one) == 1 else rf"\mathrm{{{one}}}") for one in low)
        return f"${letter}_{{{below}}}$" if below else f"${letter}$"

    text = text.replace("$", "")
    return prose(NAME.sub(symbol, text))


def rich(text: str) -> str:
    """For HTML, escaped: every Greek name, and every letter with a digit or parts, set as a symbol; code between backticks."""

    def symbol(match: re.Match[str]) -> str:
        found = name_parts(match, letters=False)
        if found is None:
            return match[0]
        letter, accents, low = found
        below = " ".join(GREEK.get(one, one) for one in low)
        return letter + "".join(ACCENTS[one][1] for one in accents) + (f"<sub>{below}</sub>" if below else "")

    text = re.sub(r"\|(?=[⁻¹²³])", "|\N{WORD JOINER}", numerals(prose(NAME.sub(symbol, escape(text)))))
    text = re.sub(r"`([^`]+)`", r"<code>\1</code>", text)
    return text.replace("&gt;=", "≥").replace("&lt;=", "≤").replace("^T", "<sup>T</sup>")


def typed(text: str) -> str:
    """For a terminal: Greek letters, a subscript right after them; names in Latin letters stay as they are."""

    def symbol(match: re.Match[str]) -> str:
        found = name_parts(match, letters=False)
        if found is None or found[0] == match[1]:
            return match[0]
        letter, accents, low = found
        return letter + "".join(ACCENTS[one][1] for one in accents) + "".join(GREEK.get(one, f"_{one}") for one in low)

    return numerals(prose(NAME.sub(symbol, text))).replace("\N{NO-BREAK SPACE}", " ")


def numerals(text: str) -> str:
    """Powers of ten and negative numbers as people write them."""
    text = re.sub(r"(?<![\w.])(\d+(?:\.\d+)?)e\+0[0-5]\b", lambda match: f"{float(match[0]):,.0f}", text)
    text = re.sub(r"(?<![\w.])1e([+-]\d+)\b", lambda match: power_of_ten(int(match[1])), text)
    text = re.sub(r"(?<=\d)e([+-]\d+)\b", lambda match: f" × {power_of_ten(int(match[1]))}", text)
    text = re.sub(r"(?<![\w.)\]⁰¹²³⁴⁵⁶⁷⁸⁹-])-(?=\d)", "−", text)
    return unbroken(text)


def unbroken(text: str) -> str:
    """The same, with no line break inside a power of ten, or between a number, or its interval, and its unit."""
    return MEASURE.sub("\N{NO-BREAK SPACE}", text).replace(" × 10", "\N{NO-BREAK SPACE}×\N{NO-BREAK SPACE}10")


def prose(text: str) -> str:
    """Minus, plus or minus, roots, micro and powers as such."""
    text = re.sub(r"\+-(?=[ \d])", "±", re.sub(r"\bsqrt\((?:(\w+)\))?", lambda match: f"√{match[1] or '('}", text))
    text = re.sub(r"(?<=\d )u(?=(?:m|rad|N|J|W)\b)", "µ", text).replace(" - ", " − ")
    return re.sub(r"\^(-?\d+)\b(?!\.\d)", lambda match: match[1].translate(POWERS), text)


def power_of_ten(exponent: int) -> str:
    return f"10{str(exponent).translate(POWERS)}"


DIGITS = 3
"""Of a number that comes without an interval."""

ROUNDING = 1e-12
"""Of a number, what sums of many flights may be off."""

SEEN = 1e-3
"""An angle [rad]."""

PREFIXES = {-9: "n", -6: "µ", -3: "m", 3: "k", 6: "M", 9: "G"}


LEAST = 5e-11
"""Of what is smaller than this, text has a power of ten: 1.03 × 10⁻¹³ m."""

IN_THOUSANDTHS = {"m": 1.0, "s": 0.1}
"""Of what is smaller than this, text has thousandths or less."""


def prefixed(unit: str, largest: float) -> tuple[str, float]:
    """A unit that suits values up to `largest`, and the factor to it: 3e-5 m reads as 30 µm, 3e-5 of no unit as 30 of 10⁻⁶."""
    unit = prose(unit)
    if 0.05 <= largest < 1e4 or largest == 0.0 or not math.isfinite(largest):
        return unit, 1.0
    exponent = 3 * math.floor(math.log10(largest / 0.05) / 3.0) if largest < 0.05 else 3 * int(math.log10(largest) // 3)
    prefix = PREFIXES.get(exponent)
    if prefix and unit != "-" and "," not in unit:
        return prefix + unit, 10.0**-exponent
    return " ".join([power_of_ten(exponent), *([] if unit == "-" else [unit])]), 10.0**-exponent


def handy(unit: str, largest: float) -> tuple[str, float]:
    """The same for text: lengths below a metre and times below 0.1 s read better in thousandths; degrees, decibels and no unit
    have no prefix, nor has what is below the least prefix.
    """
    if unit in ("-", "dB") or unit.startswith("°") or 0.0 < largest < LEAST:
        return unit, 1.0
    if 0.0 < largest < IN_THOUSANDTHS.get(unit, 0.0):
        return prefixed(unit, min(largest, 0.049))
    return prefixed(unit, largest)


ANGLES = ("rad", "rad/s")
"""Units of which a person reads degrees."""


def suited(unit: str, largest: float) -> tuple[str, float]:
    """As `handy`, but degrees for angles and their rates that are zero or can be seen, and millionths for others."""
    if unit in ANGLES and 1e-8 < largest <= SEEN:
        return f"µ{unit}", 1e6
    if unit not in ANGLES or 0.0 < largest <= SEEN:
        return handy(unit, largest)
    return unit.replace("rad", "°"), math.degrees(1.0)


def number(value: float, digits: int = DIGITS, places: int | None = None) -> str:
    """So many digits, none lost and no exponent from 0.001 to a million; a true minus. places: so many decimals instead."""
    if not math.isfinite(value):
        return "–" if math.isnan(value) else "−∞" if value < 0.0 else "∞"
    size = abs(value)
    if not size:
        return "0"
    if places is None and not 1e-3 <= size < 1e6:
        mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
        return f"{mantissa} × {power_of_ten(int(exponent))}".replace("-", "−")
    if places is None:
        places = max(0, digits - 1 - math.floor(math.log10(size)))
    return f"{value:,.{places}f}".replace("-", "−")


def rounded_down(value: float, digits: int) -> float:
    """To so many digits, never more than it is, so that "at least" is true of it."""
    scale = 10.0 ** (digits - 1 - math.floor(math.log10(abs(value)))) if value else 1.0
    return math.floor(value * scale) / scale


def rounded_up(value: float, digits: int) -> float:
    """The same, never less than it is, so that "at most" is true of it."""
    return -rounded_down(-value, digits)


def quantity(value: float, unit: str = "-", digits: int = DIGITS) -> str:
    """A number with a unit that suits it: 0.00477 m is 4.77 mm.

    >>> quantity(0.00477, "m"), quantity(12345.0, "N"), quantity(0.5)
    ('4.77 mm', '12.3 kN', '0.500')
    """
    unit, factor = handy(unit, abs(value))
    return number(factor * value, digits) + unit_suffix(unit)


def unit_suffix(unit: str) -> str:
    """A unit as it follows its number: after a space that does not break, but for degrees."""
    return "" if unit == "-" else unit if unit.startswith("°") else f"\u00a0{unit}"


def digits_of(value: float, low: float, high: float) -> int:
    """As many as tell the ends of an interval apart, with one to spare, from two to six."""
    width = high - low
    if not math.isfinite(width) or width <= ROUNDING * abs(value) or not value or not math.isfinite(value):
        return DIGITS
    return min(6, max(2, math.floor(math.log10(abs(value))) - math.floor(math.log10(width / 3.0)) + 1))


def interval(value: float, low: float, high: float, unit: str = "-", largest: float = 0.0, width: float = 0.0) -> str:
    """A number with its interval, unless that is the number alone, all in one unit and to digits that its width warrants.
    largest, width: of what shares the unit, such as the rest of a row, and of an interval there, for a number without one.

    >>> interval(0.01234, 0.0119, 0.0128, "m"), interval(0.524, 0.51, 0.54, "rad")
    ('12.3 [11.9, 12.8] mm', '30 [29, 31]°')
    """
    text, below, above, unit = interval_texts(value, low, high, unit, largest, width)
    if not (math.isnan(low) or math.isnan(high) or high - low <= ROUNDING * abs(value)):
        text = f"{text} [{below}, {above}]"
    return text + unit


def estimate(value: float, low: float, high: float, unit: str = "-", _: float = 0.0, width: float = 0.0) -> str:
    """The number alone, as `interval` writes it beside its interval, in a unit that suits it.

    >>> estimate(0.01234, 0.0119, 0.0128, "m")
    '12.3 mm'
    """
    text, *_ends, unit = interval_texts(value, low, high, unit, width=width)
    return text + unit


def in_one_unit(
    estimates: Sequence[tuple[float, float, float] | None], unit: str, text: Callable[..., str] = interval
) -> list[str]:
    """Numbers with their intervals as a row has them: the unit suits the largest, as far as the others can be written in it; a
    dash for what there is not, 0 for what only rounding leaves. A number without an interval is as precise as those with one.
    text: `estimate`, for the numbers alone, each in its own unit.

    >>> in_one_unit([(0.2534, 0.246, 0.259), (4.4e-5, 4.2e-5, 4.7e-5), (2e-7, 1e-7, 3e-7), None], "m")
    ['253 [246, 259] mm', '0.044 [0.042, 0.047] mm', '0.20 [0.10, 0.30] µm', '–']
    >>> in_one_unit([(0.36078, 0.36060, 0.36130), (0.36058, 0.36058, 0.36058)], "m")
    ['360.8 [360.6, 361.3] mm', '360.6 mm']
    """
    largest = max((abs(one[0]) for one in estimates if one and math.isfinite(one[0])), default=0.0)
    least, width = (
        1e-3 / suited(unit, largest)[1],
        max((one[2] - one[1] for one in estimates if one and one[2] > one[1]), default=0.0),
    )

    def written(estimate: tuple[float, float, float]) -> str:
        value, low, high = (0.0 if abs(one) < ROUNDING * largest else one for one in estimate)
        return text(value, low, high, unit, largest if abs(value) >= least else 0.0, width)

    return [written(one) if one else "–" for one in estimates]


def interval_texts(
    value: float, low: float, high: float, unit: str, largest: float = 0.0, width: float = 0.0
) -> tuple[str, str, str, str]:
    """A number and the ends of its interval with as many decimals, and the unit that follows them, if there is one. largest,
    width: as of `interval`.
    """
    ends = [abs(one) for one in (value, low, high) if math.isfinite(one)]
    unit, factor = suited(unit, largest or max(ends, default=0.0))
    digits = digits_of(value, low, high) if high > low else max(DIGITS, digits_of(value, value, value + width))
    largest = factor * max(ends, default=0.0)
    plain = 1e-3 <= largest < 1e6 and value
    places = max(0, digits - 1 - math.floor(math.log10(factor * abs(value)))) if plain and math.isfinite(value) else None
    text, below, above = (number(factor * one, digits, places) for one in (value, low, high))
    return text, below, above, unit_suffix(unit)


def percent(value: float, low: float = math.nan, high: float = math.nan) -> str:
    """A share, with its interval if there is one; as many digits as it takes to tell it from 0 and from 100 %."""
    shares = [100.0 * one for one in (value, low, high)]
    rest = min(100.0 - shares[0], shares[0]) if math.isfinite(shares[0]) else 0.0
    places = 1 if rest >= 1.0 else min(6, 1 - math.floor(math.log10(rest) + 1e-9)) if rest > 1e-9 else 1
    if math.isfinite(low) and math.isfinite(high) and high > low:
        places = max(places, min(6, 1 - math.floor(math.log10(100.0 * (high - low)))))

    def text(one: float) -> str:
        return f"{one:.{places}f}" if one not in (0.0, 100.0) else f"{one:g}"

    return (
        f"{text(shares[0]).removesuffix('.0')} %"
        if math.isnan(low) or low == value == high
        else f"{text(shares[0])} [{text(shares[1])}, {text(shares[2])}] %"
    )


def interval_of_share(value: float, low: float, high: float) -> str:
    """The interval of a share with the digits of `percent`, for below a card that has the share alone."""
    return f"95 % interval: {percent(value, low, high).partition(' ')[2]}"


def counted(number: int, noun: str) -> str:
    """So many of what a noun with a regular plural names.

    >>> counted(1, "flight"), counted(2, "flight")
    ('1 flight', '2 flights')
    """
    return f"{number:,} {noun}{'s' * (number != 1)}"


def listed(names: Sequence[str], word: str = "and") -> str:
    """Names as a sentence has them.

    >>> listed([]), listed(["a"]), listed(["a", "b", "c"])
    ('', 'a', 'a, b and c')
    """
    return f" {word} ".join([*([", ".join(names[:-1])] if names[1:] else []), *names[-1:]])


def metric(full: str) -> tuple[str, str]:
    """Words and unit of a metric's name: `position_rmse[m]` is position RMSE in m, `variation_thrust[N]` thrust variation."""
    name, _, unit = full.partition("[")
    name = re.sub("^(effort|variation)_(.+)", r"\2_\1", name)
    return name.replace("_", " ").replace("rmse", "RMSE"), unit.rstrip("]") or "-"
