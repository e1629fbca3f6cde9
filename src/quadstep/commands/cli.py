"""The command line: its commands, how errors are said, and the exit codes."""

import gc
import os
import platform
import signal
import sys
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures.process import BrokenProcessPool
from types import FrameType
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup
from typer.exceptions import TyperException

from quadstep.commands.arguments import VARIABLE, problem_message, refuse_empty
from quadstep.commands.options import PlainCommand, expanded
from quadstep.io.doors import Door
from quadstep.io.errors import BAD_INPUT, INTERRUPTED, OUTPUT_LOST, InterruptedRun, UserError
from quadstep.io.files import WRITTEN
from quadstep.io.user_code import NAMED, blamed, print_whole, refuse, user_error, warn_of_users_only
from quadstep.report.pool import provide_writable
from quadstep.report.screen import OutputError, complain, prepare_streams, say, width

if TYPE_CHECKING:
    from typer._click import Context, HelpFormatter


def version_lines() -> list[str]:
    """Version; engine, processor and what code is written for; Python and what computes. Raises UserError."""
    import llvmlite
    import numpy as np

    from quadstep.engines.kernel import host
    from quadstep.io import __version__

    processor = host()
    llvm = ".".join(map(str, llvmlite.binding.llvm_version_info))
    return [
        f"quadstep {__version__}",
        f"engine lanes: LLVM {llvm}, {processor.doubles} numbers in f64 at once, for {processor.name}",
        f"Python {platform.python_version()}, NumPy {np.__version__}, {platform.system()} on {platform.machine()}",
    ]


SELDOM = 50_000
"""Objects made between searches for garbage: nearly all that a command loads stays, and the search is a sixth of its start."""

HELP_WIDTHS = 50, 100
"""Fewest and most columns that help is set in."""


class Commands(TyperGroup):
    """Commands whose list in the help has the whole first sentence of each; without one of them the help is shown."""

    def parse_args(self, ctx: "Context", args: list[str]) -> list[str]:
        """Takes nothing for a request for help."""
        return super().parse_args(ctx, args or ["--help"])

    def sections(self, names: Sequence[str]) -> Mapping[str, Sequence[str]]:
        """The names of commands, by heading."""
        return {"Commands": names}

    def format_commands(self, ctx: "Context", formatter: "HelpFormatter") -> None:
        for heading, names in self.sections(self.list_commands(ctx)).items():
            with formatter.section(heading):
                commands = {name: self.get_command(ctx, name) for name in names}
                formatter.write_dl([(name, one.get_short_help_str(1000)) for name, one in commands.items() if one])


COMMANDS = Door("quadstep.commands", {
    "new": "quadstep.commands.new:new",
    "fly": "quadstep.commands.fly:fly",
    "page": "quadstep.commands.serve:page",
    "serve": "quadstep.commands.serve:serve",
    "campaign": "quadstep.commands.campaign:campaign",
    "envelope": "quadstep.commands.campaign:envelope",
    "tune": "quadstep.commands.campaign:tune",
    "compare": "quadstep.commands.study:compare",
    "linear": "quadstep.commands.linear:linear",
    "prove": "quadstep.commands.prove:prove",
    "vehicles": "quadstep.commands.new:vehicles",
    "vehicle": "quadstep.commands.new:making",
    "identify": "quadstep.commands.identify:identify",
    "replay": "quadstep.commands.identify:replay",
    "advise": "quadstep.commands.what_if:advise",
    "what-if": "quadstep.commands.what_if:what_if",
    "export": "quadstep.commands.linear:export",
    "serve-setpoints": "quadstep.commands.serve:serve_setpoints",
    "reproduce": "quadstep.commands.study:reproduce",
    "explain": "quadstep.commands.serve:explain",
    "verify": "quadstep.commands.prove:verify",
    "certify": "quadstep.commands.prove:certify",
    "study": "quadstep.commands.study:studies",
    "check": "quadstep.commands.new:check",
    "completion": "quadstep.commands.arguments:completion",
})  # fmt: skip
"""Functions that Typer makes commands of, or groups of them, in the order of the help."""

HEADINGS = {
    "new": "Flights", "campaign": "Many flights", "linear": "Margins and proofs", "vehicles": "Real vehicles",
    "reproduce": "The paper", "completion": "Other",
}  # fmt: skip
"""What the list of commands is headed by, from these on."""


class AllCommands(Commands):
    """The package's commands, and those of other distributions, which are loaded for the list in the help or by their name."""

    def list_commands(self, ctx: object) -> list[str]:
        own = [name for name in COMMANDS.own if name in self.commands]
        return [*own, *(name for name in COMMANDS.names if name not in COMMANDS.own)]

    def sections(self, names: Sequence[str]) -> Mapping[str, Sequence[str]]:
        found: dict[str, list[str]] = {}
        for name in names:
            heading = HEADINGS.get(name) or (list(found) or ["Commands"])[-1]
            found.setdefault(heading, []).append(name)
        return found

    def get_command(self, ctx: object, name: str) -> Any:
        """One of them; where it cannot be loaded, one that says so."""
        return self.commands.get(name) or (theirs_by(name) if name in COMMANDS else None)


def theirs_by(name: str) -> Any:
    """The command of another distribution; where there is none, one that says why, whatever its arguments."""
    app = typer.Typer(rich_markup_mode=None, add_completion=False)
    try:
        found = COMMANDS.load(name)
    except UserError as error:
        refused = error

        def fail() -> None:
            raise refused

        anything = {"allow_extra_args": True, "ignore_unknown_options": True}
        app.command(name, help=f"Error: {error}.", context_settings=anything)(fail)
    else:
        if isinstance(found, typer.Typer):
            return typer.main.get_command(found)
        app.command(name)(found)
    return typer.main.get_command(app)


def commands_to_load(arguments: Sequence[str]) -> Iterable[str]:
    """The commands to load for these arguments: the one that is typed; none for the version; else all."""
    first = next((one for one in arguments if not one.startswith("-")), "")
    if first in COMMANDS.own:
        return (first,)
    return () if [*arguments] == ["--version"] else COMMANDS.own


def built(names: Iterable[str] = COMMANDS.own) -> typer.Typer:
    """The application with its commands of these names."""
    app = typer.Typer(
        name="quadstep",
        cls=AllCommands,
        help="How well, and how reliably, will this controller keep my quadrotor on its path?\n\n"
        "To begin: `quadstep new mission.toml`, then `quadstep fly mission.toml`.",
        epilog=CODES,
        add_completion=False,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
    )
    app.callback()(options)
    for name in names:
        found = COMMANDS.load(name)
        if isinstance(found, typer.Typer):
            app.add_typer(found, name=name, cls=Commands)
        else:
            app.command(name, cls=PlainCommand)(expanded(found))
    return app


def version(shown: bool) -> None:
    """Print version, engine and processor, and stop."""
    if shown:
        for line in version_lines():
            say(line)
        raise typer.Exit


CODES = """Exit codes (docs/ci.md): 0: done. 1: evidence failed, or nothing was decided. 2: bad input. 3: the flight was lost,
or hover proved unstable. 4: a requirement is not met. 5: standard output could not be written. 130: interrupted."""
"""Of all commands; the help of each says which it has."""

OWN_CODE, TRACEBACK = "--no-user-code", "--traceback"
"""Options that may stand anywhere on the command line."""


def options(
    shown: Annotated[
        bool, typer.Option("--version", callback=version, is_eager=True, help="Print version, engine and processor.")
    ] = False,
    no_user_code: Annotated[bool, typer.Option(OWN_CODE, help="Run no Python file or module that a mission names.")] = False,
    traceback: Annotated[
        bool, typer.Option(TRACEBACK, help="Print the full traceback when your own Python code fails.")
    ] = False,
) -> None:
    """Options of every command."""


def everywhere(arguments: list[str]) -> list[str]:
    """The arguments without the options that may stand anywhere, which are obeyed."""
    end = arguments.index("--") if "--" in arguments else len(arguments)
    if OWN_CODE in arguments[:end]:
        refuse(f"{OWN_CODE} was given")
    if TRACEBACK in arguments[:end]:
        print_whole()
    return [one for one in arguments[:end] if one not in (OWN_CODE, TRACEBACK)] + arguments[end:]


def stop(_number: int, _frame: FrameType | None) -> None:
    """A request to end counts as Ctrl-C, so that nothing half-written stays."""
    raise KeyboardInterrupt


def main() -> None:
    """Run the command line; every error of the user is one line and exit code 2."""
    gc.set_threshold(SELDOM)
    prepare_streams()
    warn_of_users_only()
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is not signal.SIG_IGN:  # as nohup has it
            signal.signal(number, stop)
    provide_writable()
    if VARIABLE in os.environ:
        from typer._completion_classes import completion_init

        completion_init()  # the shell asks for completions, which the command line then answers
    try:
        code = run()
        sys.stdout.flush()
    except OutputError as error:
        complain(f"error: {error}")
        code = OUTPUT_LOST
    gc.freeze()  # what is left goes with the process: to search it for garbage took up to a sixth of a command
    sys.exit(code)


def run() -> int | None:
    """The exit code of what the command line asks for; errors are said."""
    WRITTEN.clear()
    try:
        refuse_empty(sys.argv[1:])
        code: int | None = built(commands_to_load(sys.argv[1:]))(
            everywhere(sys.argv[1:]),
            standalone_mode=False,
            prog_name="quadstep",
            terminal_width=min(max(width(sys.stdout), HELP_WIDTHS[0]), HELP_WIDTHS[1]),
        )
    except BaseException as error:
        lines, code = explained(error)
        for line in lines:
            complain(line)
        return code
    if code == INTERRUPTED:  # what typer makes of Ctrl-C
        complain(interrupted())
    return code


def interrupted() -> str:
    """What is said of a command that was interrupted, and of what it had written by then."""
    return f"interrupted; written before: {', '.join(WRITTEN)}" if WRITTEN else "interrupted; nothing was written"


def explained(error: BaseException) -> tuple[list[str], int]:
    """An error as a line for each mistake, and the exit code; raises the error itself where it is one of quadstep."""
    match error:
        case InterruptedRun():
            return [f"interrupted; {error}"], INTERRUPTED
        case KeyboardInterrupt() | typer.Abort():
            return [interrupted()], INTERRUPTED
        case UserError():
            said = error.lines
        case TyperException():
            command = getattr(getattr(error, "ctx", None), "command_path", "quadstep")
            said = [f"{problem_message(error)} (see {command} --help)"]
        case BrokenProcessPool():
            said = ["a process that draws figures was killed (out of memory?); nothing was written"]
        case _ if theirs(error):
            said = [f"{user_error(error, ', '.join(sorted(NAMED)))} ({TRACEBACK} prints all of it)"]
        case _:
            raise error
    return [f"error: {one}" for one in said], BAD_INPUT


def theirs(error: BaseException) -> bool:
    """Whether an error came from code of the user's, or from what that gave."""
    known = (UserError, InterruptedRun, typer.Abort, TyperException, BrokenProcessPool, OutputError)
    return blamed(error) is not None or (bool(NAMED) and isinstance(error, Exception) and not isinstance(error, known))
