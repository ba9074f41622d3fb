"""The command line: parse, call a verb of the package, print. Nothing is computed here and nothing imports it.

Each command is a function of a module of this folder. Heavy imports (pandas, scipy, matplotlib, numba, h5py) stay
inside the functions, so that ``frictionlab --help`` answers at once.
"""

import atexit
import contextlib
import gc
import io
import os
import re
import shutil
import sys
import textwrap
from collections.abc import Callable, Sequence
from functools import wraps
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, ParamSpec

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command as click_command

from frictionlab import __version__
from frictionlab.errors import FrictionlabError, SceneError, UsageError

P = ParamSpec("P")

GROUPS = {
    "measure": {"init": "ingest", "ingest": "ingest", "analyze": "analyze", "free-vibration": "analyze"},
    "judge": {"compare-numeric": "analyze", "explain": "analyze", "campaign": "batch", "batch": "batch"},
    "simulate": {"simulate": "simulate", "sweep": "predict", "predict": "predict", "laws": "show"},
    "plan": {"plan": "predict"},
    "look after": {"show": "show", "synthesize": "show", "tradeoff": "show"},
}
"""The commands in the groups of ``--help``, each with its module: it is the function of its name there."""
COMMANDS = {name: module for group in GROUPS.values() for name, module in group.items()}
OLD_NAMES = {
    "compare": "compare-numeric",
    "--friction-ratio": "--beta",
    "--static-ratio": "--mu",
    "--contact-damping-ratio": "--zeta",
    "--measured": "--law-file",
}
"""Names of commands and options that are still taken, for one version, and those to give instead."""
MORE = "more"
"""Where the options stand that the short help of a command leaves to ``--help-all``."""
STOPPED, CLOSED = 128 + 2, 128 + 13  # the exit status that shells give to what Ctrl-C, or a closed pipe, has stopped
PLAIN: dict[str, Any] = {
    "rich_markup_mode": None,
    "pretty_exceptions_enable": False,
    "context_settings": {"help_option_names": ["-h", "--help"]},
}


_ALL = "frictionlab: all options"  # in the context of a call: whether --help-all was said


class Command(TyperCommand):
    """A command that shows its ten most used options first, and says in plain words what is wrong with one."""

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write the options of ``--help``: the most used ones, or all of them."""
        every = ctx.meta.get(_ALL, False)
        params: list[Any] = [p for p in self.get_params(ctx) if p.param_type_name == "option"]
        more = [p for p in params if p.rich_help_panel == MORE]
        few = len(params) - len(more) > 4  # a command of few options shows them all
        for param in more:
            param.hidden = param.hidden or (few and not every)
        super().format_options(ctx, formatter)
        if more and few and not every:
            formatter.write(f"\n{len(more)} more options: frictionlab {ctx.info_name} --help-all\n")

    def parse_args(self, ctx: Any, args: list[str]) -> Any:
        """Read the options, under their old names too; what is wrong with one is said as `options.value_of` says it."""
        ctx.meta[_ALL] = "--help-all" in args
        args = [
            "--help" if word == "--help-all" else current_name(word) if word.startswith("--") else word for word in args
        ]
        if any("--contact-force" in param.opts for param in self.get_params(ctx)):
            args = _with_force_column(args)
        try:
            return super().parse_args(ctx, args)
        except typer.BadParameter as error:
            error.message = error.message.removeprefix("Value error, ")
            raise


def _with_force_column(args: list[str]) -> list[str]:
    """``--force COLUMN`` names the column of a force, where what follows is no file; alone it replaces an output."""
    found = list(args)
    for i, (word, following) in enumerate(zip(args, [*args, "-"][1:], strict=True)):
        is_column = not following.startswith("-") and not Path(following).suffix and not Path(following).exists()
        if word.startswith("--force=") or (word == "--force" and is_column):
            found[i] = word.replace("--force", "--contact-force", 1)
    return found


def current_name(word: str) -> str:
    """The name that has taken the place of an old one, with a line that says it; any other word as it is."""
    name, equals, value = word.partition("=")
    if name not in OLD_NAMES:
        return word
    complain(f"note: {name} is now {OLD_NAMES[name]}; the old name is taken until the next version")
    return f"{OLD_NAMES[name]}{equals}{value}"


class Commands(TyperGroup):
    """The commands: the one that is called is loaded, and no other."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        names: Any = dict.fromkeys(COMMANDS)  # no commands yet: a misspelt name is compared with them
        self.commands = names

    def get_command(self, ctx: Any, cmd_name: str) -> Any:  # noqa: ARG002
        """The command of a name; None where there is none."""
        cmd_name = current_name(cmd_name)
        if cmd_name not in COMMANDS:
            return None
        from frictionlab.cli.options import with_options

        alone = typer.Typer(add_completion=False, **PLAIN)
        alone.command(cmd_name, cls=Command)(errors_in_one_line(with_options(cmd_name, command_of(cmd_name))))
        return click_command(alone)

    def format_commands(self, ctx: Any, formatter: Any) -> None:  # noqa: ARG002
        """Write the list of ``--help``, which no command has to be loaded for."""
        for group, commands in GROUPS.items():
            with formatter.section(f"To {group}"):
                formatter.write_dl([(name, summary(name)) for name in commands])


def summary(name: str) -> str:
    """The first line of a command's docstring, read from its file: the list of commands loads none of them."""
    text = Path(__file__).with_name(f"{COMMANDS[name]}.py").read_text(encoding="utf-8")
    found = re.search(rf'^def {name.replace("-", "_")}\(.*?"""(.*?)\n', text, re.DOTALL | re.MULTILINE)
    return found[1] if found else ""


def command_of(name: str) -> Callable[..., None]:
    """The function of a command's name."""
    found: Callable[..., None] = getattr(import_module(f"{__name__}.{COMMANDS[name]}"), name.replace("-", "_"))
    return found


app = typer.Typer(cls=Commands, no_args_is_help=True, **PLAIN)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"frictionlab {__version__}")
        raise typer.Exit


def _clear_cache(wanted: bool) -> None:
    if wanted:
        from frictionlab.simulator.compiled import clear_cache

        errors_in_one_line(lambda: typer.echo(clear_cache()))()
        raise typer.Exit


@app.callback()
def frictionlab(
    _version: Annotated[
        bool,
        typer.Option("--version", "-V", callback=_print_version, is_eager=True, help="Print the version and leave."),
    ] = False,
    _cache: Annotated[
        bool,
        typer.Option(
            "--clear-cache", callback=_clear_cache, is_eager=True, help="Remove the machine code kept, and leave."
        ),
    ] = False,
) -> None:
    """Friction damping measured: from laser logs to energy per cycle, regime and friction coefficient.

    A folder of logs in two commands: frictionlab init my_logs, then frictionlab batch my_logs --campaign.

    Exit status: 0 all well, 1 some input failed, 2 the command line or the scene is wrong, 130 stopped by Ctrl-C.
    """


def printable(text: str) -> str:
    """Show control characters instead of sending them to the terminal."""
    return "".join(c if c.isprintable() or c == " " else c.encode("unicode_escape").decode() for c in text)


def folded(text: str, indent: str = "    ") -> str:
    """A text in lines of the terminal's width, of COLUMNS or, in a pipe, of 80 letters; paths and names stay whole."""
    width = shutil.get_terminal_size().columns
    return textwrap.fill(
        printable(text), width, subsequent_indent=indent, break_on_hyphens=False, break_long_words=False
    )


def complain(text: str) -> None:
    """Print a line of complaint on stderr."""
    typer.echo(folded(f"frictionlab: {text}"), err=True)


class LostOutputError(Exception):
    """Standard output takes no more: its disk is full, or who read it has gone (``| head``), which is no fault."""

    def __init__(self, error: OSError) -> None:
        super().__init__(f"standard output: {error.strerror or error}")
        self.is_closed = isinstance(error, BrokenPipeError)
        self.status = CLOSED if self.is_closed else 1

    def reported(self) -> int:
        """The exit status, after a line about it where it is a fault."""
        if not self.is_closed:
            complain(str(self))
        return self.status


class _Guarded(io.TextIOWrapper):
    """A standard stream whose faults cannot be taken for those of a file.

    Standard output raises `LostOutputError`; standard error drops what it cannot report, and nothing else is lost.
    """

    def write(self, text: str, /) -> int:
        """Write; a fault is one of the stream."""
        self._guard(super().write, text)
        return len(text)

    def flush(self) -> None:
        """Flush; a fault is one of the stream."""
        self._guard(super().flush)

    def _guard(self, do: Callable[..., object], *what: str) -> None:
        try:
            do(*what)
        except OSError as error:
            with contextlib.suppress(OSError, ValueError):  # what is still to be printed goes nowhere, also at the exit
                os.dup2(os.open(os.devnull, os.O_WRONLY), self.fileno())
            if self is sys.stdout:
                raise LostOutputError(error) from error


def guard_standard_streams() -> None:
    """Let standard output raise nothing but `LostOutputError`; a file's name need not be text that it can print."""
    for name in ("stdout", "stderr"):
        plain, is_error = getattr(sys, name), name == "stderr"
        if plain is None:  # closed by who started this: what is printed goes nowhere
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115 - open to the end
        elif isinstance(plain, io.TextIOWrapper):
            how: dict[str, Any] = {"line_buffering": is_error or plain.line_buffering, "write_through": is_error}
            setattr(sys, name, _Guarded(plain.buffer, plain.encoding, "backslashreplace", **how))


def errors_in_one_line(command: Callable[P, None]) -> Callable[P, None]:
    """Turn an error into one line on stderr and an exit status: 2 for scene and usage, else 1. The one place.

    A scene with several faults has one line each.
    """

    @wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        try:
            command(*args, **kwargs)
            sys.stdout.flush()  # what was printed reaches its place now, or is reported as lost
        except LostOutputError as error:
            raise typer.Exit(error.reported()) from error
        except (typer.Exit, typer.Abort, typer.BadParameter):
            raise
        except KeyboardInterrupt as error:
            complain("stopped")
            raise typer.Exit(STOPPED) from error
        except (SceneError, UsageError) as error:
            for line in str(error).split("\n"):
                complain(line)
            raise typer.Exit(2) from error
        except Exception as error:
            from frictionlab.verbs.inputs import reason_of

            reason = str(error) if isinstance(error, FrictionlabError) else reason_of(error)
            if isinstance(error, FileNotFoundError) and error.filename is None:  # of asking where we are
                reason = "the folder that is worked in is no longer there: change into one that is"
            elif isinstance(error, OSError) and error.filename:
                reason = f"{error.filename}: {error.strerror}"
            complain(reason)
            raise typer.Exit(1) from error

    return run


def announce_compiling(arguments: Sequence[str]) -> None:
    """Let the simulator's compiler say on stderr that it begins, unless somebody asked for silence."""
    if not {"--json", "--quiet", "-q"}.intersection(arguments):
        import logging

        logger = logging.getLogger("frictionlab.simulator")
        logger.setLevel(logging.INFO)
        logger.handlers[:] = [logging.StreamHandler()]


def main() -> None:
    """Entry point of the ``frictionlab`` command."""
    guard_standard_streams()
    gc.set_threshold(100_000, 50, 50)  # to look for garbage among the objects of libraries takes 0.3 s of 2 s
    atexit.register(gc.freeze)
    if sys.argv[1:] and sys.argv[1][0] != "-":  # a command; the list of commands waits for none of this
        from frictionlab.workers import keep_freed_memory, use_one_thread

        use_one_thread()
        keep_freed_memory()
        announce_compiling(sys.argv[1:])
    try:
        app()
    except LostOutputError as error:  # of what no command prints: --help and --version
        sys.exit(error.reported())
