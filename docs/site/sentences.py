"""The sentences of a page, from which the search shows one for each result."""

import re
from collections.abc import Iterator

from docutils import nodes

LATEX = re.compile(r"\\(?:[cd]*dot|hat|tilde|bar|text|mathrm|left|right|[,;! ])|[\\{}]")
"""What of a formula nobody reads aloud."""


def sentences(tree: nodes.document) -> list[tuple[str, str]]:
    """Those of paragraphs, and the rows of tables, each with the id of its section; listings are passed over."""
    found = []
    for block in tree.findall(lambda one: isinstance(one, nodes.paragraph | nodes.row)):
        parents = list(above(block))
        if any(isinstance(one, nodes.row) for one in parents):
            continue
        section = next((one["ids"][0] for one in parents if isinstance(one, nodes.section)), "")
        cells = block.children if isinstance(block, nodes.row) else [block]
        text = ": ".join(filter(None, map(plain, cells)))
        found += [(section, one) for one in re.split(r"(?<=[a-z0-9)%][.!?]) (?=[A-Z])", text) if one]
    return found


def above(node: nodes.Node) -> Iterator[nodes.Node]:
    """What contains a node, from the inside out."""
    while (node := node.parent) is not None:
        yield node


def plain(block: nodes.Node) -> str:
    """The text of a block, with formulas as they are read, without marks of links."""
    parts = [LATEX.sub("", one) if isinstance(one.parent, nodes.math) else one for one in block.findall(nodes.Text)]
    return " ".join("".join(parts).replace("¶", "").split())
