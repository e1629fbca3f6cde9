"""What the user's own code adds to the identity of a result: what it says, and the constants that it has captured."""

import contextlib
import hashlib
import sys
from collections.abc import Iterable, Iterator, Mapping, Set
from dataclasses import fields, is_dataclass
from functools import cache, partial
from pathlib import Path
from types import CodeType, FunctionType, MethodType, ModuleType

from quadstep.io.errors import UserError
from quadstep.io.places import code_of, package_code, sources
from quadstep.io.user_code import DIGITS, PREFIX, families

PLAIN = (bool, int, float, complex, str, bytes, type(None))
"""What is told apart by how it is written."""


def own_code(part: object) -> frozenset[str]:
    """Digests of the user's code of which a part of a flight, or anything in it, is made; none where all is this package's."""
    module = getattr(part, "__module__", "") or ""
    code = code_of_module(module)
    own = {f"{code} {captured_digest(part, home(module))}"} if code or home(module) == "__main__" else set()
    return frozenset(own.union(*map(own_code, inner(part))))


def inner(part: object) -> Iterable[object]:
    """What a part of a flight consists of."""
    if is_dataclass(part):
        return [getattr(part, one.name, None) for one in fields(part)]  # a class, or one with slots, may lack some
    return part if isinstance(part, tuple) else ()


def as_it_is(part: object) -> str:
    """A digest of the user's code in a part of a flight as it is in memory, whatever its file says: a notebook may have
    replaced a function, its code, or what it reads. Empty where all is this package's.
    """
    parts, found = [part], []
    for one in parts:
        parts += inner(one)
        found += [one] if is_own(type(one).__module__) else []
    bases = {base for one in {type(one) for one in parts} for base in one.__mro__ if base.__module__.startswith("quadstep.")}
    for holder in (*bases, *(sys.modules[name] for name in {base.__module__ for base in bases})):
        found += [one for one in vars(holder).values() if type(one) is FunctionType and is_own(one.__module__)]
    return " ".join(sorted({captured_digest(one) for one in found}))


def described(part: object) -> str:
    """What a part of a flight is where text tells it whole; nothing of users' code, and of what text leaves something out."""
    said = repr(part)
    return "" if own_code(part) or any(one in said for one in ("array(", " at 0x", "...", "<locals>")) else said


def in_memory() -> str:
    """The constants of this package's modules as they are now; nothing where a user has replaced one of its functions
    (`Geometric.command = mine`), as only a trace shows what that computes. Takes some milliseconds.
    """
    total = hashlib.sha256()
    for name, module in sorted(sys.modules.items()):
        if not name.startswith("quadstep."):
            continue
        classes = [one for one in vars(module).values() if isinstance(one, type) and one.__module__ == name]
        for holder in (module, *classes):
            for key, value in vars(holder).items():
                if isinstance(value, PLAIN) and not key.startswith("__"):
                    total.update(f"{name} {key} {value!r}\n".encode(errors="backslashreplace"))
                elif isinstance(origin := getattr(value, "__module__", None), str) and is_users(origin):
                    return ""
    return total.hexdigest()


def is_users(name: str) -> bool:
    """Whether a module is neither this package's, nor Python's, nor installed."""
    top = name.partition(".")[0]
    if top == "quadstep" or top in sys.stdlib_module_names or top not in sys.modules:
        return False
    return "-packages" not in (getattr(sys.modules[top], "__file__", None) or "")


def code_of_module(name: str) -> str:
    """A digest of the user's code that a module belongs to; nothing for one of this package or of Python."""
    top = name.partition(".")[0]
    if top.startswith(PREFIX):
        return code_of(families[home(name)].contents)
    if not top or top == "quadstep" or top in sys.stdlib_module_names:
        return ""
    with contextlib.suppress(UserError):  # typed in by hand, or too many files
        script = getattr(sys.modules.get(top), "__file__", None) if top == "__main__" else None
        return code_of(sources(Path(script))) if script else package_code(top)
    return ""


def home(module: str) -> str:
    """What modules have in common that belong together: a script's with those beside it, or a package's."""
    return module.partition(".")[0][: len(PREFIX) + DIGITS]


def is_own(module: str, own: str | None = None) -> bool:
    """Whether a module is one of these, or without these one of the user's."""
    if own is not None:
        return home(module) == own
    return not module.startswith("quadstep.") and (module.startswith(PREFIX) or is_users(module))


def captured_digest(thing: object, own: str | None = None) -> str:
    """A digest of the constants in a thing of the user's, and in all that it refers to: they tell closures of one code apart.

    These are what functions find where they were defined (values in closures, defaults, names of their module) and the
    attributes of classes and objects: numbers, text, arrays, and tuples, lists and dicts of them. Of other people's objects
    only the type counts. own: the `home` of what is the user's; None: all of the user's, by its code in memory.
    """
    told: list[str] = []
    waiting = [thing]
    seen: dict[int, tuple[int, object]] = {}  # kept alive, so that no other object gets their id
    while waiting:
        one = waiting.pop()
        if isinstance(one, PLAIN):
            told.append(f"{one!r} 0\n")
        elif id(one) in seen:
            told.append(f"again {seen[id(one)][0]} 0\n")
        else:
            seen[id(one)] = len(seen), one
            said = (one if isinstance(one, type | FunctionType) else type(one)).__qualname__
            held = list(contents(one, own))
            told.append(f"{said} {len(held)}\n")
            waiting += reversed(held)
    return hashlib.sha256("".join(told).encode(errors="backslashreplace")).hexdigest()


def contents(one: object, own: str | None) -> Iterator[object]:
    """What a thing consists of or refers to."""
    users = is_own(getattr(one, "__module__", "") or "", own)
    if isinstance(one, tuple | list):
        yield from one
    elif isinstance(one, Mapping):
        yield from one.items()
    elif isinstance(one, Set):
        yield from sorted(repr(part) for part in one if isinstance(part, PLAIN))
    elif isinstance(one, FunctionType):
        yield from (one.__defaults__, one.__kwdefaults__, *cells(one), *(names(one, own) if users else ()))
    elif isinstance(one, type):
        yield from (part for base in one.__mro__ if is_own(base.__module__, own) for part in members(base))
    elif is_dataclass(one):
        yield from (type(one), *(getattr(one, field.name, None) for field in fields(one)))
    elif isinstance(one, ModuleType):
        yield from members(one) if own is None and is_own(one.__name__, own) else ()
    elif users:
        yield from (type(one), object.__getstate__(one))
    else:
        yield from (getattr(one, name) for kind, all_ in HOLDERS.items() if isinstance(one, kind) for name in all_)
        with contextlib.suppress(TypeError, ValueError, NotImplementedError):
            held = memoryview(one)  # type: ignore[arg-type]
            yield from (held.format, held.shape, held.tobytes())


HOLDERS = {
    MethodType: ("__self__", "__func__"), partial: ("func", "args", "keywords"), type(cache(len)): ("__wrapped__",),
    staticmethod: ("__func__",), classmethod: ("__func__",), property: ("fget",),
}  # fmt: skip
"""What else holds a function, and where."""


def members(base: type | ModuleType) -> Iterator[object]:
    """What a class or module defines."""
    return (value for name, value in vars(base).items() if isinstance(value, FunctionType) or not name.startswith("__"))


def cells(function: FunctionType) -> Iterator[object]:
    """What a function has captured of the one that it is in."""
    for cell in function.__closure__ or ():
        with contextlib.suppress(ValueError):  # not yet given
            yield cell.cell_contents


def names(function: FunctionType, own: str | None) -> Iterator[object]:
    """What a function finds in its module; its code too, where that is in no file, or may no longer be that of its file."""
    codes, given = [function.__code__], function.__globals__
    for code in codes:
        codes += [one for one in code.co_consts if isinstance(one, CodeType)]
        yield from (given[name] for name in code.co_names if name in given and not name.startswith("__"))
        if own is None or "__file__" not in given:
            yield from (code.co_code, *(one for one in code.co_consts if not isinstance(one, CodeType)))
