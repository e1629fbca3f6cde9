r"""Formulas: LaTeX as MathML, which browsers set themselves. One way for site, lessons, reports and the article.

What is understood is what those pages use (docs/decisions/0019): letters, numbers, Greek, accents, sub- and superscripts,
fractions, roots, functions, delimiters, matrices, aligned lines, text, and `\class{name}{...}`, which gives a part of a
formula a name for style sheets and scripts. Anything else is a ValueError, so that no page shows half a formula.
"""

import re
from collections.abc import Callable
from html import escape

GREEK = {
    "alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "epsilon": "ϵ", "varepsilon": "ε", "eta": "η", "theta": "θ",
    "kappa": "κ", "lambda": "λ", "mu": "μ", "xi": "ξ", "pi": "π", "sigma": "σ", "tau": "τ", "phi": "φ", "chi": "χ", "psi": "ψ",
    "omega": "ω", "Gamma": "Γ", "Delta": "Δ", "Lambda": "Λ", "Sigma": "Σ", "Phi": "Φ", "Psi": "Ψ", "Omega": "Ω",
    "ell": "ℓ", "infty": "∞",
}  # fmt: skip
OPERATORS = {
    "le": "≤", "ge": "≥", "ne": "≠", "approx": "≈", "in": "∈", "cdot": "⋅", "times": "×", "to": "→", "pm": "±", "mp": "∓",
    "ldots": "…", "dots": "…", "cdots": "⋯", "Leftrightarrow": "⇔", "Rightarrow": "⇒", "succ": "≻", "ll": "≪", "gg": "≫",
    "partial": "∂", "circ": "∘", "colon": ":", "lbrace": "{", "rbrace": "}", "{": "{", "}": "}", "%": "%", "vert": "|",
}  # fmt: skip
ACCENTS = {"dot": "˙", "ddot": "¨", "dddot": "⃛", "hat": "ˆ", "widehat": "ˆ", "tilde": "˜", "bar": "¯", "vec": "→"}
FUNCTIONS = frozenset(("sin", "cos", "tan", "arctan", "exp", "min", "max", "sup", "inf", "det", "log"))
LARGE = {"int": "∫", "sum": "∑", "prod": "∏"}
SPACES = {"quad": "1em", "qquad": "2em", ",": "0.17em", ";": "0.28em", ":": "0.22em", "!": "-0.17em", " ": "0.25em"}
FENCES = {"lvert": "|", "rvert": "|", "lVert": "‖", "rVert": "‖", "|": "‖", "langle": "⟨", "rangle": "⟩", "{": "{", "}": "}"}
MATRICES = {"bmatrix": "[]", "pmatrix": "()", "cases": "{", "aligned": "", "matrix": ""}
"""Environments with what stands around them."""

OPEN = frozenset(("(", "[", ",", "=", "<", ">", "+", "-", "&", *(f"\\{name}" for name in OPERATORS), r"\left"))
"""After these a sign is of one number, and no space stands before a function."""
SPACED = tuple(f"\\{name}" for name in SPACES)
THIN = '<mspace width="0.17em"></mspace>'

CELL_ENDS = frozenset(("&", r"\\", r"\end"))

TOKEN = re.compile(r"\\[A-Za-z]+|\\.|\d+(?:\.\d+)?(?:\{,\}\d+)?|[^\s]|\s+", re.DOTALL)
TAG = re.compile(r"\\tag\{([^{}]*)\}")


def mathml(latex: str, block: bool = False) -> str:
    r"""A formula as a `<math>` element, its source inside for those who copy it. Raises ValueError for what is not understood.

    block: displayed on a line of its own; a `\tag` is left out, see `displayed`.
    """
    source = TAG.sub("", latex).strip()
    reader = Reader(TOKEN.findall(source), source, block)
    content = reader.row(ends=frozenset())
    display = ' display="block"' if block else ""
    note = f'<annotation encoding="application/x-tex">{escape(source)}</annotation>'
    return f"<math{display}><semantics><mrow>{content}</mrow>{note}</semantics></math>"


def displayed(latex: str) -> str:
    r"""A displayed formula as HTML, the number that `\tag` gives it at the right. Raises ValueError."""
    found = TAG.search(latex)
    number = f'<span class="tag">({escape(found[1])})</span>' if found else ""
    return f'<div class="equation" tabindex="0">{mathml(latex, block=True)}{number}</div>'


CLOSING = re.compile(r"[,.;:!?)'’-]*")
"""Punctuation after a formula."""

SOURCE = re.compile(r"\$\$(.+?)\$\$|\$([^$\n]+?)\$", re.DOTALL)


def typeset(text: str, around: Callable[[str], str] = escape) -> str:
    """Text in which formulas stand between dollar signs, as HTML. around: makes HTML of what is between them."""
    parts, done = [], 0
    for found in SOURCE.finditer(text):
        after = "" if found[1] else CLOSING.match(text, found.end())[0]  # type: ignore[index]
        parts += [around(text[done : found.start()]), displayed(found[1]) if found[1] else in_line(found[2], around(after))]
        done = found.end() + len(after)
    return "".join([*parts, around(text[done:])])


def in_line(latex: str, after: str = "") -> str:
    """A formula within a line. after: markup of punctuation, before which browsers would otherwise begin a new line."""
    return f'<span style="white-space:nowrap">{mathml(latex)}{after}</span>' if after else mathml(latex)


class Reader:
    """Reads the tokens of a formula one after the other."""

    def __init__(self, tokens: list[str], source: str, block: bool) -> None:
        self.tokens, self.source, self.block, self.at = tokens, source, block, 0

    def wrong(self, what: str) -> ValueError:
        """An error that shows the formula."""
        return ValueError(f"{what} in the formula {self.source!r}")

    def peek(self) -> str:
        """The next token, "" at the end; spaces are skipped."""
        while self.at < len(self.tokens) and self.tokens[self.at].isspace():
            self.at += 1
        return self.tokens[self.at] if self.at < len(self.tokens) else ""

    def take(self, wanted: str = "") -> str:
        """The next token, which has to be `wanted` if that is given."""
        token = self.peek()
        if not token or (wanted and token != wanted):
            raise self.wrong(f"{wanted or 'something'} is missing")
        self.at += 1
        return token

    def row(self, ends: frozenset[str]) -> str:
        """Everything up to a token that ends it, which is not taken."""
        parts, before = [], "("
        while (token := self.peek()) and token not in ends:
            if token in ("-", "+", r"\pm", r"\mp") and before in OPEN:
                parts.append(self.scripted().replace("<mo>", '<mo form="prefix">', 1))
            else:
                if token.removeprefix("\\") in FUNCTIONS and before not in OPEN:
                    parts.append(THIN)
                parts.append(self.scripted())
            before = token if token not in ("'", *SPACED) else before
        return "".join(parts)

    def group(self) -> str:
        """An argument: what is between braces, or the next thing."""
        if (token := self.peek()) != "{":
            if token.isdigit():  # of a number without braces TeX takes one digit
                self.tokens[self.at : self.at + 1] = [*token]
            return self.thing()
        self.take("{")
        content = self.row(frozenset("}"))
        self.take("}")
        return f"<mrow>{content}</mrow>"

    def words(self) -> str:
        """An argument that is text, as it is written."""
        self.take("{")
        start = self.at
        while self.at < len(self.tokens) and self.tokens[self.at] != "}":
            self.at += 1
        text = "".join(self.tokens[start : self.at])
        self.take("}")
        return text

    def scripted(self) -> str:
        """A thing with its sub- and superscript, and its primes."""
        first = self.peek()
        base, low, high = self.thing(), "", ""
        while (token := self.peek()) in ("_", "^", "'"):
            self.take()
            if token == "'":
                base = f'<mrow>{base}<mo lspace="0" rspace="0">′</mo></mrow>'
            elif token == "_":
                low = self.group()
            else:
                high += self.group()
        room = ""
        if high and first.removeprefix("\\") in ACCENTS:  # or the superscript would stand above the accent
            room = f' height="{0.66 if re.search(r">[A-ZΓ-Ω0-9]<", base) else 0.47}em"'
        if low and re.search(r">[fgjpqyβγζημξρφχψ]<", base):  # or the subscript would hang below that of other letters
            room += ' depth="0"'
        if room:
            base = f"<mpadded{room}>{base}</mpadded>"
        over = first == r"\sum" and self.block
        kind = (
            ("under" if low else "") + ("over" if high else "") if over else ("sub" if low else "") + ("sup" if high else "")
        )
        high = f"<mrow>{high}</mrow>" if high else ""
        applied = self.applied() if first.removeprefix("\\") in FUNCTIONS else ""
        return f"<m{kind}>{base}{low}{high}</m{kind}>{applied}" if low or high else base

    def applied(self) -> str:
        """What stands between a function and its argument."""
        return "<mo>&#8289;</mo>" + (THIN if self.peek() not in ("(", r"\left") else "")

    def thing(self) -> str:  # noqa: PLR0911 (a table of cases)
        """One letter, number, operator or command."""
        token = self.take()
        if token.startswith("\\"):
            return self.command(token[1:])
        if token == "{":
            self.at -= 1
            return self.group()
        if token in "}&_^":
            raise self.wrong(f"a {token} where none can be")
        if token.isalpha():
            return f"<mi>{token}</mi>"
        if token[0].isdigit():
            return f"<mn>{token.replace('{,}', ',')}</mn>"
        if token == "|":
            return '<mo stretchy="false" lspace="0" rspace="0">|</mo>'
        if token == "/":
            return '<mo lspace="0" rspace="0">/</mo>'
        if token in "()[]":
            return f'<mo stretchy="false">{token}</mo>'
        return f"<mo>{escape({'-': '−', '*': '∗', '~': ' '}.get(token, token))}</mo>"

    def command(self, name: str) -> str:  # noqa: PLR0911 (a table of cases)
        if name in GREEK:
            upright = ' mathvariant="normal"' if name[0].isupper() or name == "infty" else ""
            return f"<mi{upright}>{GREEK[name]}</mi>"
        if name in FUNCTIONS:
            return f"<mi>{name}</mi>" if self.peek() in ("_", "^") else f"<mi>{name}</mi>{self.applied()}"
        if name in SPACES:
            return f'<mspace width="{SPACES[name]}"></mspace>'
        if name in LARGE:
            return f"<mo>{LARGE[name]}</mo>"
        if name in FENCES and name not in "{}":
            return f'<mo stretchy="false" lspace="0" rspace="0">{FENCES[name]}</mo>'
        if name in OPERATORS:
            return f"<mo>{escape(OPERATORS[name])}</mo>"
        if name in ACCENTS:
            return f'<mover accent="true">{self.group()}<mo stretchy="false">{ACCENTS[name]}</mo></mover>'
        if name in ("frac", "tfrac"):
            small = ' displaystyle="false"' if name == "tfrac" else ""
            return f"<mfrac{small}>{self.group()}{self.group()}</mfrac>"
        if name == "sqrt":
            return f"<msqrt>{self.group()}</msqrt>"
        return self.environment(name)

    def environment(self, name: str) -> str:
        """Commands with arguments of other kinds."""
        if name in ("text", "mathrm", "operatorname"):
            words = escape(self.words())
            return f"<mtext>{words}</mtext>" if name == "text" else f'<mi mathvariant="normal">{words}</mi>'
        if name == "mathbf":
            return f'<mi class="bold">{escape(self.words())}</mi>'
        if name == "class":
            return f'<mrow class="{escape(self.words())}">{self.group()}</mrow>'
        if name == "left":
            opening = self.fence()
            content = self.row(frozenset((r"\right",)))
            self.take(r"\right")
            return f"<mrow>{opening}{content}{self.fence()}</mrow>"
        if name == "begin":
            return self.rows(self.words())
        raise self.wrong(f"\\{name} is not understood")

    def fence(self) -> str:
        """A delimiter as high as what it encloses; a dot is none."""
        token = self.take().removeprefix("\\")
        return "" if token == "." else f'<mo stretchy="true" fence="true">{escape(FENCES.get(token, token))}</mo>'

    def rows(self, name: str) -> str:
        """A matrix, cases, or lines aligned at their ampersands."""
        if name not in MATRICES:
            raise self.wrong(f"\\begin{{{name}}} is not understood")
        lines: list[list[str]] = [[]]
        while True:
            lines[-1].append(self.row(CELL_ENDS))
            token = self.take()
            if token == r"\end":
                break
            if token == r"\\":
                lines.append([])
        if self.words() != name:
            raise self.wrong(f"\\end{{{name}}} is missing")
        body = "".join(f"<mtr>{''.join(f'<mtd>{cell}</mtd>' for cell in line)}</mtr>" for line in lines if any(line))
        kind = ' class="aligned" displaystyle="true"' if name == "aligned" else f' class="{name}"'
        around = [f'<mo stretchy="true" fence="true">{one}</mo>' for one in MATRICES[name]]
        first, last = around[0] if around else "", around[1] if len(around) > 1 else ""
        return f"<mrow>{first}<mtable{kind}>{body}</mtable>{last}</mrow>"


PLAIN = re.compile(
    r"(?P<prose>`[^`]*`|(?:[A-Za-z]\.){2,}|\d+x\d+|\ba(?= (?:[a-z]{3,}|\dx\d))|\(a\)|'s\b|[A-Za-z]{3,}'s"
    r"|\[?(?:rad|m)/s(?:\^2)?\]?|(?<=[\d)] )(?:N m|[NmsJ])\b(?! [=(+-]|\^))"
    r"|(?P<half>1/2 )?d/d(?P<by>t|eta)\b|(?P<times>(?<=[\dN)] )x(?= [\dN(])|(?<=omega )x\b)"
    r"|(?P<name>[A-Za-z]+?)(?P<digits>\d*)(?P<parts>(?:_[A-Za-z0-9]+)*)(?P<wave>~?)(?![A-Za-z0-9_])"
    r"|(?P<number>\d+(?:\.\d+)?)(?:e(?P<power>[+-]\d+))?"
    r"|\^(?P<raised>T|-?\d+)|_(?P<below>min|max)|(?P<sign><=|>=|!=|\.\.\.|[-=<>+/|(){},\[\];])|(?P<space> +)|."
)
"""The pieces of a text without LaTeX, in which formulas stand as in code."""

SIGNS = {"<=": r"\le", ">=": r"\ge", "!=": r"\ne", "...": r"\dots", "{": r"\{", "}": r"\}"}
SPELLED = {
    "eps": r"\varepsilon", "int": r"\int", "th": r"\theta", "ph": r"\phi", "thd": r"\theta_d", "phd": r"\phi_d",
    **{name: rf"\operatorname{{{name}}}" for name in ("atan", "atan2", "tr", "diag", "sym")},
    **{f"{name}{axis}": f"{name}_{axis}" for name in "RS" for axis in "xyz"},
}  # fmt: skip
OVER = {"dot": r"\dot", "dd": r"\ddot", "ddd": r"\dddot", "hat": r"\hat", "tilde": r"\tilde"}
ROOT = re.compile(r"\\sqrt\(([^()]*)\)")
BREAKS = re.compile(r"(?<=[^({\[,;=e]) (?=[-+=<>]|\\[lg]e\b)|(?<=[,;]) ")
BRACKETS = {")": "(", "]": "[", "}": "{"}
LONG = 60
"""Of a formula as LaTeX that may break where a sum or list goes on."""


def letters(name: str) -> str:
    """A name of one piece as LaTeX; empty for a word."""
    if name in SPELLED or name in GREEK or name in FUNCTIONS or name == "sqrt":
        return SPELLED.get(name, f"\\{name}")
    return name if len(name) == 1 else ""


def piece(match: re.Match[str]) -> str:
    """A piece of a formula as LaTeX; empty for what is prose."""
    if match["by"]:
        return (r"\tfrac{1}{2}" if match["half"] else "") + rf"\frac{{d}}{{d{letters(match['by'])}}}"
    if match["name"]:
        whole = letters(match["name"] + match["digits"])
        base, below = whole or letters(match["name"]), [match["digits"]] if match["digits"] and not whole else []
        for part in match["parts"].split("_")[1:]:
            if part in OVER:
                base = base and rf"{OVER[part]}{{{base}}}"
            else:
                below.append(letters(part) or (part if part[-1].isdigit() else rf"\mathrm{{{part}}}"))
        base = rf"\tilde{{{base}}}" if base and match["wave"] else base
        return f"{base}_{{{' '.join(below)}}}" if base and below else base
    if match["number"]:
        return match["number"] + (rf" \times 10^{{{int(match['power'])}}}" if match["power"] else "")
    if match["raised"] or match["below"]:
        return f"^{{{match['raised']}}}" if match["raised"] else rf"_{{\{match['below']}}}"
    return r"\times" if match["times"] else SIGNS.get(match["sign"] or "", match["sign"] or "") or match["space"] or ""


def set_off(pieces: list[tuple[str, str]]) -> str:
    """A run of pieces, each as it was and as LaTeX: formulas between dollars, commas and brackets of the sentence outside."""
    inside, parts, start = set[int](), [], 0
    opened: list[int] = []
    for at, (plain, _) in enumerate(pieces):
        if plain in BRACKETS.values():
            opened.append(at)
        elif plain in BRACKETS and opened:
            first = opened.pop()
            inside |= {first, at} if opened else {*range(first, at + 1)}
    for at, (plain, _) in enumerate(pieces):
        if plain in ",;()[]{}" and at not in inside:
            parts += [formula(pieces[start:at]), plain]
            start = at + 1
    return "".join([*parts, formula(pieces[start:])])


def formula(pieces: list[tuple[str, str]]) -> str:
    """One formula between dollars, long ones in several; what has no letter stays as it was."""
    plain = "".join(one for one, _ in pieces)
    latex = "".join(one for _, one in pieces)
    if not re.search(r"[A-Za-z]|(?<!\d)-\d", latex):
        return plain
    bars = iter(range(latex.count("|")))
    latex = re.sub(r"\|", lambda _: (r"\lvert ", r"\rvert ")[next(bars) % 2], latex)
    latex = ROOT.sub(r"\\sqrt{\1}", re.sub(r"(?<=\d) (?=\d)", r"\\;", latex))
    lines = [""]
    for one in BREAKS.split(latex.strip()):
        if lines[-1] and len(lines[-1]) + len(one) > LONG and lines[-1].count("{") == lines[-1].count("}"):
            lines.append("{}" * (one[0] in "-+"))
        lines[-1] = f"{lines[-1]} {one}".strip()
    room = len(plain) - len(plain.lstrip()), len(plain) - len(plain.rstrip())
    return " " * room[0] + " ".join(f"${one}$" for one in lines) + " " * room[1]


def dollars(text: str) -> str:
    r"""Text in which formulas are written as in code, with LaTeX between dollars: `W_tilde_1^T mu_1`, `sqrt(a^2 + b^2)`.

    >>> dollars("theta_d >= 0 and e1_dot")
    '$\\theta_{d} \\ge 0$ and $\\dot{e}_{1}$'
    """
    parts: list[str] = []
    run: list[tuple[str, str]] = []
    for found in PLAIN.finditer(text):
        latex = piece(found)
        if latex:
            run.append((found[0], latex))
        else:
            parts += [set_off(run), found[0].replace("^2", "²")]
            run = []
    return "".join([*parts, set_off(run)])
