"""Names as the code writes them, set as the field writes them: tau_psi as a Greek letter with a Greek subscript."""

import re
from html import escape

GREEK = {
    "psi": "ψ", "theta": "θ", "phi": "φ", "tau": "τ", "kappa": "κ", "sigma": "σ", "xi": "ξ", "eta": "η", "omega": "ω",
    "delta": "δ", "eps": "ε", "mu": "µ", "Lambda": "Λ", "Omega": "Ω", "Gamma": "Γ", "Sigma": "Σ",
}  # fmt: skip
ACCENTS = {"dot": ("dot", "\u0307"), "ddot": ("ddot", "\u0308"), "tilde": ("tilde", "\u0303"), "hat": ("hat", "\u0302")}
"""Of a name: as a command of TeX, as a combining character."""

ANGLES = frozenset(("roll", "pitch", "yaw"))
"""Words that are symbols where something stands below them."""

NAME = re.compile(r"(?<![\w.])(?!T\d\b)([^\W\d_]+)(\d?)((?:_[^\W_]+)*)(?![\w]|\.\w)")
"""A letter or word, perhaps a digit, perhaps parts after underscores; nothing with dots, which are keys of files, and no
number of a statement (T1 to T16)."""

UNITS = frozenset(("m", "s", "N", "J", "W", "V", "g"))
MEASURE = re.compile(r"(?<=[\d\]∞⁰¹²³⁴⁵⁶⁷⁸⁹]) (?=(?:%|[nµmkMG]?(?:m|s|g|N|J|W|V|Hz|rad)[²³]?)(?![\w²³]))")
"""The space before a unit."""

POWERS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def parts(match: re.Match[str], letters: bool) -> tuple[str, list[str], list[str]] | None:
    """Letter, accents and subscripts of a name, None if it is a word. letters: whether one letter alone is a symbol."""
    name, digit, tail = match.groups()
    low = [one for one in (digit, *tail.split("_")) if one]
    is_symbol = name in GREEK or (len(name) == 1 and (letters or bool(low))) or (name in ANGLES and bool(low))
    if not is_symbol:
        return None
    return GREEK.get(name, name), [one for one in low if one in ACCENTS], [one for one in low if one not in ACCENTS]


def label(text: str) -> str:
    """For Matplotlib's mathtext: every name, and every single letter, set as a symbol."""

    def symbol(match: re.Match[str]) -> str:
        found = parts(match, letters=True)
        if found is None or (match[0] in UNITS and text[: match.start()].rstrip()[-1:].isdigit()):
            return match[0]
        letter, accents, low = found
        if letter in ANGLES:
            letter = rf"\mathrm{{{letter}}}"
        for accent in accents:
            letter = rf"\{ACCENTS[accent][0]}{{{letter}}}"
        below = ",".join(GREEK.get(one, one if len(one) == 1 else rf"\mathrm{{{one}}}") for one in low)
        return f"${letter}_{{{below}}}$" if below else f"${letter}$"

    text = text.replace("$", "")
    return prose(NAME.sub(symbol, text))


def rich(text: str) -> str:
    """For HTML, escaped: every Greek name, and every letter with a digit or parts, set as a symbol."""

    def symbol(match: re.Match[str]) -> str:
        found = parts(match, letters=False)
        if found is None:
            return match[0]
        letter, accents, low = found
        below = " ".join(GREEK.get(one, one) for one in low)
        return letter + "".join(ACCENTS[one][1] for one in accents) + (f"<sub>{below}</sub>" if below else "")

    text = re.sub(r"\|(?=[⁻¹²³])", "|\N{WORD JOINER}", numerals(prose(NAME.sub(symbol, escape(text)))))
    return coded(text).replace("^T", "<sup>T</sup>")


def typed(text: str) -> str:
    """For a terminal: Greek letters, a subscript right after them; names in Latin letters stay as they are."""

    def symbol(match: re.Match[str]) -> str:
        found = parts(match, letters=False)
        if found is None or found[0] == match[1]:
            return match[0]
        letter, accents, low = found
        return letter + "".join(ACCENTS[one][1] for one in accents) + "".join(GREEK.get(one, f"_{one}") for one in low)

    return numerals(prose(NAME.sub(symbol, text))).replace("\N{NO-BREAK SPACE}", " ")


def coded(text: str) -> str:
    """Code between backticks, and comparisons. text: escaped."""
    text = re.sub(r"`([^`]+)`", r"<code>\1</code>", text)
    return text.replace("&gt;=", "≥").replace("&lt;=", "≤")


def numerals(text: str) -> str:
    """Powers of ten and negative numbers as people write them."""
    text = re.sub(
        r"(?<![\w.])(\d+(?:\.\d+)?)e\+0[0-5]\b", lambda match: f"{float(match[0]):,.0f}".replace(",", "\u202f"), text
    )
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
    return re.sub(r"\^(-?\d)\b", lambda match: match[1].translate(POWERS), text)


def power_of_ten(exponent: int) -> str:
    """10 to this power."""
    return f"10{str(exponent).translate(POWERS)}"
