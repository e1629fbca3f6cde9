"""The page of the Python interface, from docstrings."""

import inspect
import re
from collections.abc import Iterator
from functools import cached_property
from importlib import import_module
from types import ModuleType
from typing import Any

from docs.site.reference.markdown import prose

HEAD = """\
# The Python interface

What `quadstep` and its public packages offer, from their docstrings; the examples in them are tested.
[From Python](../python.md) is an introduction.
"""

FRONTS = ("quadstep", "quadstep.own", "quadstep.control", "quadstep.world.paths", "quadstep.world.pieces", "quadstep.numbers")
"""Packages whose names are public."""


def paragraphs(text: str) -> Iterator[str]:
    """A docstring as Markdown: its examples as code, other text as it is."""
    for block in inspect.cleandoc(text).split("\n\n"):
        indented = all(line.startswith("    ") for line in block.splitlines())
        if block.lstrip().startswith(">>>") or indented:
            yield f"```python\n{inspect.cleandoc(block)}\n```"
        elif "\n- " in f"\n{block}":
            head, *items = f"\n{block}".split("\n- ")
            yield "\n".join([prose(head), *(f"- {prose(' '.join(one.split()))}" for one in items)]).strip()
        else:
            yield prose(block)


def signature(name: str, thing: Any) -> str:
    """How it is called."""
    try:
        text = f"{name}{inspect.signature(thing)}"
    except (TypeError, ValueError):
        return name
    return re.sub(r"\b(?:[a-z_]\w*\.)+(\w+)", r"\1", text).replace("(self, ", "(").replace("(self)", "()")


def own_doc(thing: Any) -> str:
    """A docstring of its own, not one that it inherits or that is made for it."""
    text = thing.__doc__ or ""
    return "" if text.startswith(f"{getattr(thing, '__name__', '')}(") else text


def members(thing: type) -> Iterator[tuple[str, Any]]:
    """The public methods and properties of a class of the package, with how each is used."""
    for name, one in vars(thing).items():
        value = isinstance(one, property | cached_property)
        inner = one.fget if isinstance(one, property) else getattr(one, "__func__", getattr(one, "func", one))
        if not name.startswith("_") and inspect.isfunction(inner) and own_doc(inner):
            yield name if value else signature(name, inner), inner


def entry(name: str, thing: Any) -> str:
    """One public name."""
    text = own_doc(thing) if callable(thing) else ""
    parts = [f"### {name}"]
    if callable(thing):
        parts += [f"```python\n{signature(name, thing)}\n```"]
    parts += paragraphs(text) if text else ()
    for inner, one in members(thing) if isinstance(thing, type) else ():
        head, *rest = paragraphs(one.__doc__ or "")
        parts += [f"**`{inner}`** {head}", *rest]
    return "\n\n".join(parts)


def names(module: ModuleType) -> list[tuple[str, Any]]:
    """The public names of a package that say what they are."""
    return [(name, one) for name in module.__all__ if callable(one := getattr(module, name))]


def section(front: str) -> str:
    """One package."""
    module = import_module(front)
    return "\n\n".join([f"## {front}", *paragraphs(module.__doc__ or ""), *(entry(*one) for one in names(module))])


def page() -> str:
    """The whole page."""
    return "\n\n".join([HEAD, *map(section, FRONTS)]) + "\n"
