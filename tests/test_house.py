"""The house keeps its plan: who may import whom, no heavy import at the door, every command with an example."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from frictionlab.cli import COMMANDS, command_of, summary
from tests import weigh
from tests.desk import told_by

PACKAGE = Path(__file__).parents[1] / "frictionlab"

# Part -> the parts it may import. What a part may not import cannot flow back into it.
ALL = "arrays"  # types that every module may name
PLAN = """
__init__:
arrays: errors
errors:
simulator: errors schema
files: errors
schema: __init__
tables: errors files hdf5 schema
workers: __init__ errors
recording: errors schema units
units:
log_options: units
scene: errors files log_options simulator
experiment: errors files scene units
hdf5: __init__ errors files recording schema units
maps: errors files hdf5 schema simulator tables workers
logs: errors files hdf5 log_options recording units
analysis: errors recording scene schema uncertainty
uncertainty: scene schema
planning: analysis errors inference scene schema simulator uncertainty
inference: analysis base_motion errors files recording scene schema simulator uncertainty
synthetic: errors files recording scene schema simulator units
campaign: analysis errors files hdf5 inference scene schema simulator tables uncertainty
tradeoff: analysis inference recording scene schema simulator
base_motion: analysis errors recording simulator
figures: analysis base_motion campaign errors files inference recording schema simulator tables
verbs: __init__ analysis base_motion campaign errors experiment figures files hdf5 inference logs planning
  recording report scene schema simulator synthetic tables uncertainty workers
__main__: cli
report: __init__ analysis campaign figures files inference scene schema simulator tables uncertainty
"""
MAY_IMPORT = {
    own: set(allowed.split())
    for own, _, allowed in (line.partition(":") for line in re.split(r"\n(?! )", PLAN.strip()))
}
# what a module of analysis other than measurement and stretches may import beside its neighbours
KERNELS = {"uncertainty", "errors", "schema"}
HEAVY = ("numpy", "scipy", "pandas", "matplotlib", "numba", "h5py", "pydantic", "rich", "asyncio", "filelock")
OWNERS = {
    "distributed": {"workers"},
    "h5py": {"hdf5"},
    "matplotlib": {"figures", "verbs"},  # verbs: for its type alone
    "typer": {"cli"},
    "rich": {"cli"},
}


def modules() -> Iterator[tuple[str, Path]]:
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        yield parts[0], path


@cache
def imports(path: Path) -> frozenset[str]:
    package, found = ("frictionlab", *path.relative_to(PACKAGE).parts[:-1]), set[str]()
    for node in ast.walk(weigh.parsed(path)):
        if isinstance(node, ast.Import):
            found.update(name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            module = node.module or ""
            if node.level:
                module = ".".join((*package[: len(package) - node.level + 1], module)).rstrip(".")
            if module == "frictionlab":
                found.update(f"frictionlab.{n.name}" if n.name != "__version__" else module for n in node.names)
            else:
                found.add(module)
    return frozenset(found)


def parts_imported(path: Path) -> set[str]:
    own = (name.split(".") for name in imports(path) if name.split(".")[0] == "frictionlab")
    return {parts[1] if len(parts) > 1 else "__init__" for parts in own}


def test_every_part_imports_only_what_its_plan_allows() -> None:
    faults = [
        f"{path.relative_to(PACKAGE.parent)} imports {part}"
        for own, path in modules()
        if own != "cli"
        for part in parts_imported(path) - MAY_IMPORT.get(own, set()) - {own, ALL}
    ]
    assert not faults


def test_the_plan_allows_nothing_that_nobody_uses() -> None:
    used: dict[str, set[str]] = {}
    for own, path in modules():
        used.setdefault(own, set()).update(parts_imported(path))
    unused = {own: allowed - used.get(own, set()) for own, allowed in MAY_IMPORT.items()}
    assert not {own: parts for own, parts in unused.items() if parts}


def test_the_house_stays_within_its_budgets() -> None:
    limits, measured = weigh.budgets(), weigh.totals()
    over = {name: (measured[name], limit) for name, limit in limits.items() if measured[name] > limit}
    assert not over, "measured, allowed; `python -m tests.weigh` prints the sizes of each folder"


@pytest.mark.parametrize(("command", "arguments"), weigh.COMMANDS.items())
def test_a_command_executes_few_modules(command: str, arguments: tuple[str, ...]) -> None:
    assert weigh.modules_executed(command, arguments) <= weigh.budgets("executed")[command]


def test_analysis_kernels_know_no_recording_and_no_scene() -> None:
    kernels = [
        p for own, p in modules() if own == "analysis" and p.stem not in ("measurement", "stretches", "__init__")
    ]
    faults = [f"{p.name} imports {part}" for p in kernels for part in parts_imported(p) - KERNELS - {"analysis", ALL}]
    assert not faults


@pytest.mark.parametrize("library", sorted(OWNERS))
def test_a_library_with_an_owner_is_imported_nowhere_else(library: str) -> None:
    strangers = [str(p) for own, p in modules() if own not in OWNERS[library] and _uses(p, library)]
    assert not strangers


def _uses(path: Path, library: str) -> bool:
    return any(name.split(".")[0] == library for name in imports(path))


@pytest.mark.parametrize(
    ("door", "heavy"),
    [
        ("frictionlab", HEAVY),
        ("frictionlab.cli", HEAVY),
        ("frictionlab.simulator; frictionlab.simulator.Problem(0.5, 0.4)", ("numba", "scipy", "pandas", "h5py")),
        ("frictionlab.verbs.one_test", ("scipy", "pandas", "matplotlib", "numba")),
        ("frictionlab.verbs.one_test", ("scipy.interpolate", "scipy.stats", "scipy.integrate", "matplotlib", "numba")),
    ],
)
def test_a_door_opens_without_what_it_does_not_need(door: str, heavy: tuple[str, ...]) -> None:
    code = f"import sys, {door}; print([m for m in {heavy!r} if m in sys.modules])"
    assert told_by(code).strip() == "[]"


def test_every_command_is_documented_with_an_example() -> None:
    told = {name: command_of(name).__doc__ or "" for name in COMMANDS}
    assert not [name for name, text in told.items() if "Example: frictionlab " not in text]
    assert {name: text.partition("\n")[0] for name, text in told.items()} == {name: summary(name) for name in COMMANDS}


def test_a_command_is_a_module_of_the_command_line_that_help_does_not_load() -> None:
    code = (
        "import sys; from typer.testing import CliRunner; from frictionlab.cli import app;"
        "print(CliRunner().invoke(app, ['--help']).stdout, [m for m in sys.modules if m.startswith('frictionlab.')])"
    )
    told = told_by(code)
    listed = told.partition("To measure:")[2]
    assert re.findall(r"^  ([a-z-]+)  ", listed, re.MULTILINE) == list(COMMANDS)
    assert " ".join(summary("free-vibration").split()) in " ".join(listed.split())
    assert not [module for module in COMMANDS.values() if f"frictionlab.cli.{module}'" in told]
    assert "frictionlab.tables" not in told


def test_there_is_no_attic() -> None:
    assert not list(PACKAGE.rglob("utils*"))
