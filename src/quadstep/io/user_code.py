"""Running the user's files, each once for each content, apart from all others; what went wrong in one, in one line."""

import builtins
import contextlib
import importlib
import inspect
import linecache
import sys
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any, TextIO

from quadstep.io.errors import UserError, cut
from quadstep.io.places import Place, digest_of, package_files, sibling, sources

FILES: set[str] = set()
"""Files of users that were run in this process."""

NAMED: set[str] = set()
"""What missions named of these, as they wrote it."""


whole = False
"""Whether tracebacks are printed."""

printed: set[str] = set()
"""Those that were."""


def print_whole() -> None:
    """From now on the traceback of each error is printed, once."""
    global whole  # noqa: PLW0603 (a policy of the process)
    whole = True


def warn_of_users_only() -> None:
    """From now on Python shows warnings of users' files alone, unless it was told which to show, by -W or $PYTHONWARNINGS:
    nobody else can act on those of libraries. What a result is warned of, its command says itself.
    """
    if not sys.warnoptions:
        warnings.showwarning = show_of_users


def show_of_users(
    message: Warning | str, category: type[Warning], filename: str, lineno: int, file: TextIO | None = None,
    line: str | None = None,
) -> None:  # fmt: skip
    """What Python calls to show a warning."""
    if filename in FILES:
        (file or sys.stderr).write(warnings.formatwarning(message, category, filename, lineno, line))


def user_error(error: BaseException, named: str = "") -> UserError:
    """The error as one line. named: what to name if no line of a user's file is to blame."""
    if whole:
        said_before, text = len(printed), "".join(traceback.format_exception(error))
        printed.add(text)
        if len(printed) > said_before:
            sys.stderr.write(text)
    found = blamed(error)
    if found is None:
        return UserError(f"{named}: {message_of(error)}")
    file, line, said = found
    text = linecache.getline(file, line).strip()
    return UserError(f"{file}:{line}: {said}" + (f"; the line: {cut(text, 200)}" if text else ""))


@contextmanager
def in_one_line() -> Iterator[None]:
    """A block in which an error in a user's file is a UserError."""
    try:
        yield
    except Exception as error:
        if isinstance(error, UserError) or blamed(error) is None:
            raise
        raise user_error(error) from error


def blamed(error: BaseException) -> tuple[str, int, str] | None:
    """The innermost line of a user's file that led to an error, and what is said; None for an error that is not the user's."""
    for one in chain(error):
        said = message_of(one)
        if isinstance(one, SyntaxError) and one.filename in FILES:
            return str(one.filename), one.lineno or 0, said
        for frame in reversed(traceback.extract_tb(one.__traceback__)):
            if frame.filename in FILES:
                return frame.filename, frame.lineno or 0, said
    return None


def defined_at(function: object) -> str:
    """File and line of a user's function or method, in brackets after a blank; nothing for one of others."""
    code = getattr(function, "__code__", None)
    return f" ({Path(code.co_filename).name}:{code.co_firstlineno})" if code and code.co_filename in FILES else ""


def check_callable(
    name: str, function: Callable[..., object], given: Sequence[str], owner: Sequence[str] = (), whose: str = ""
) -> None:
    """Refuses a user's function or method that cannot be called with these arguments. owner: its `self`. Raises UserError."""
    with contextlib.suppress(ValueError):  # of one that tells no signature
        takes = inspect.signature(function)
        try:
            takes.bind(*given)
        except TypeError:
            said = f"{whose}{name}: should be declared as {name}({', '.join((*owner, *given))})"
            raise UserError(f"{said}{defined_at(function)}") from None


def message_of(error: BaseException) -> str:
    """What an error says, and of which type it is."""
    try:
        said = str(error.msg if isinstance(error, SyntaxError) else error)
    except Exception:
        said = ""
    if isinstance(error, ImportError) and str(error.name).partition(".")[0] == "quadstep":
        said += "; what your own code needs is in quadstep.own (docs/extending.md)"
    return f"{type(error).__name__}: {said}" if said else type(error).__name__


def chain(error: BaseException | None) -> Iterator[BaseException]:
    seen: set[int] = set()
    while error is not None and id(error) not in seen:
        seen.add(id(error))
        yield error
        error = error.__cause__ or error.__context__


PREFIX = "quadstep_user_"
"""How the modules of users are called in sys.modules, followed by so many digits of a digest."""
DIGITS = 16

families: dict[str, "Family"] = {}
refused = ""
"""Why no code of users may run; nothing where it may."""
trusted: Sequence[str] | None = None
"""The files and modules that may run where a mission is a stranger's; None where all may."""


def refuse(reason: str) -> None:
    """From now on no code of users is run."""
    global refused  # noqa: PLW0603 (a policy of the process)
    refused = reason


@contextlib.contextmanager
def only(names: Sequence[str]) -> Iterator[None]:
    """Meanwhile no code of users is run but these files, wherever a mission looks for ones of their names, and modules."""
    global trusted  # noqa: PLW0603 (a policy of the process)
    trusted = names
    try:
        yield
    finally:
        trusted = None


def refuse_stranger(place: Place, folder: Path) -> Path:
    """The folder in which to look for what a mission names. Raises UserError for code that may not run."""
    if trusted is None:
        return folder
    for one in trusted:
        file = Path(one)
        if one == place.where or file.name == Path(place.where).name or (file.suffix == ".py" and file.stem == place.where):
            return file.parent
    raise UserError(f"{place.text}: is code, which is not run unless you name its file: --controller {place.where}")


def load(place: Place, folder: Path) -> object:
    """The class or function that a mission names. folder: the mission's. Raises UserError."""
    if refused:
        raise UserError(f"{place.text}: user code is not run: {refused}")
    own = refuse_stranger(place, folder)
    path = (place if own is folder else place._replace(where=Path(place.where).name)).file(own)
    if path is None and place.text not in NAMED:
        with contextlib.suppress(UserError):  # too many files
            FILES.update(map(str, package_files(place.where.partition(".")[0])))
    NAMED.add(place.text)
    try:
        module = family_of(path).module(path) if path else importlib.import_module(place.where)
    except (UserError, KeyboardInterrupt):
        raise
    except BaseException as error:  # SystemExit too
        said = user_error(error, str(path or place.text))
        raise (UserError(f"{place.text}, which {place.origin} registers: {said}") if place.origin else said) from error
    if not hasattr(module, place.name):
        known = [name for name, one in vars(module).items() if getattr(one, "__module__", "") == module.__name__]
        raise UserError(f"{path or place.where}: has no {place.name!r}; it defines {', '.join(known) or 'nothing'}")
    return getattr(module, place.name)


class Family:
    """A file and those beside it that it imports, as modules of their own."""

    def __init__(self, folder: Path, contents: Mapping[Path, bytes], name: str) -> None:
        self.folder, self.contents, self.name = folder, contents, name

    def module(self, path: Path) -> ModuleType:
        """The module of a file, run when first asked for."""
        name = f"{self.name}_{path.stem}"
        if name in sys.modules:
            return sys.modules[name]
        module = ModuleType(name)
        module.__file__ = str(path)
        module.__dict__["__builtins__"] = {**vars(builtins), "__import__": self.own_import, "print": print_to_stderr}
        sys.modules[name] = module
        FILES.add(str(path))
        try:
            exec(compile(self.contents[path], str(path), "exec", dont_inherit=True), module.__dict__)
        except BaseException:
            del sys.modules[name]
            raise
        return module

    def own_import(
        self, name: str, spaces: Mapping[str, object] | None = None,
        locally: Mapping[str, object] | None = None, fromlist: Sequence[str] | None = (), level: int = 0,
    ) -> object:  # fmt: skip
        """What `import` does in these files: a file beside the others goes before what Python finds."""
        path = None if level else sibling(self.folder, name)
        if path is None or path not in self.contents:
            return builtins.__import__(name, spaces, locally, fromlist or (), level)
        return self.module(path)


def print_to_stderr(*values: Any, file: Any = None, **how: Any) -> None:
    """What `print` does in these files: standard output is for results."""
    print(*values, file=file or sys.stderr, **how)


def family_of(path: Path) -> Family:
    """The family of a file, with its present content."""
    contents = sources(path)
    name = PREFIX + digest_of([(str(path), b""), *((str(one), contents[one]) for one in sorted(contents))])[:DIGITS]
    return families.setdefault(name, Family(path.parent, contents, name))
