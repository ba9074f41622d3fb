"""The command line: parse, call a verb of the package, print. Nothing is computed here and nothing imports it.

Each command is one module of this folder. Heavy imports (pandas, scipy, matplotlib, numba, h5py) stay inside the
functions, so that ``frictionlab --help`` answers at once.
"""

import sys
from collections.abc import Callable
from functools import wraps
from typing import Annotated, ParamSpec

import typer

from frictionlab import __version__
from frictionlab.cli.analyze import analyze
from frictionlab.cli.batch import batch
from frictionlab.cli.campaign import campaign
from frictionlab.cli.compare_numeric import compare_numeric
from frictionlab.cli.free_vibration import free_vibration
from frictionlab.cli.ingest import ingest
from frictionlab.cli.init import init
from frictionlab.cli.output import complain
from frictionlab.cli.plan import plan
from frictionlab.cli.show import show
from frictionlab.cli.simulate import simulate
from frictionlab.cli.standard_output import LostOutputError, guard_standard_output, standard_output
from frictionlab.cli.sweep import sweep
from frictionlab.cli.synthesize import synthesize
from frictionlab.cli.tradeoff import tradeoff
from frictionlab.errors import FrictionlabError, SceneError, UsageError
from frictionlab.process import collect_rarely, keep_freed_memory, use_one_thread
from frictionlab.verbs.failures import reason_of

P = ParamSpec("P")

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"frictionlab {__version__}")
        raise typer.Exit


@app.callback()
def frictionlab(
    _version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and leave.")
    ] = False,
) -> None:
    """Friction damping measured: from laser logs to energy per cycle, regime and friction coefficient.

    The way of the data: ingest (log -> recording), analyze (recording -> measurement), compare-numeric
    (measurement over prediction).
    """


def errors_in_one_line(command: Callable[P, None]) -> Callable[P, None]:
    """Turn an error into one line on stderr and an exit status: 2 for scene and usage, else 1. The one place.

    A scene with several faults has one line each.
    """

    @wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        try:
            command(*args, **kwargs)
            with standard_output():
                pass  # what was printed reaches its place now, or is told to be lost
        except LostOutputError as error:
            _tell_lost(error)
            raise typer.Exit(error.status) from error
        except (typer.Exit, typer.Abort, typer.BadParameter):
            raise
        except (SceneError, UsageError) as error:
            for line in str(error).split("\n"):
                complain(line)
            raise typer.Exit(2) from error
        except Exception as error:
            complain(_reason(error))
            raise typer.Exit(1) from error

    return run


def _tell_lost(error: LostOutputError) -> None:
    if not error.is_closed:
        complain(str(error))


def _reason(error: Exception) -> str:
    if isinstance(error, FrictionlabError):
        return str(error)
    return f"{error.filename}: {error.strerror}" if isinstance(error, OSError) and error.filename else reason_of(error)


COMMANDS: tuple[Callable[..., None], ...] = (
    init,
    ingest,
    analyze,
    compare_numeric,
    free_vibration,
    campaign,
    batch,
    simulate,
    sweep,
    plan,
    synthesize,
    tradeoff,
    show,
)  # in the order of the data

for _command in COMMANDS:
    app.command(short_help=(_command.__doc__ or "").partition("\n")[0])(errors_in_one_line(_command))


def main() -> None:
    """Entry point of the ``frictionlab`` command."""
    guard_standard_output()
    use_one_thread()
    keep_freed_memory()
    collect_rarely()
    try:
        app()
    except LostOutputError as error:  # of what no command prints: --help and --version
        _tell_lost(error)
        sys.exit(error.status)
