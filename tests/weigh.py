"""What the house weighs: lines, code, modules, names that occur twice; `python -m tests.weigh` prints it per folder.

The budgets stand in `tests/budgets.toml`; they only fall.
"""

import ast
import subprocess
import sys
import tempfile
import tomllib
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "frictionlab"
BUDGETS = Path(__file__).with_name("budgets.toml")
LOG = "sample_data/steel_N1.25_r0.3.csv"
SCENE = ("--scene", "configs/sample_data.toml")
COMMANDS = {
    "simulate": ("--r", "0.5", "--beta", "0.4", "--json"),
    "analyze": ("RECORDING", *SCENE, "--json"),
    "compare-numeric": ("RECORDING", *SCENE, "--json"),
}
"""The commands whose modules are counted, each with its arguments; RECORDING is the log, ingested."""
COUNT = """
import sys
folder, sys.argv = sys.argv[1], sys.argv[1:]
from frictionlab.cli import main
called = set()
def look(frame, event, _):
    code = frame.f_code
    if event == "call" and code.co_flags & 1 and code.co_filename.startswith(folder):
        called.add(code.co_filename)
sys.setprofile(look)
try:
    main()
except SystemExit:
    pass
sys.setprofile(None)
print(len(called), file=sys.stderr)
"""
"""Runs a command and counts the files with a function that was called; module and class bodies do not count."""


def budgets(table: str = "package") -> dict[str, int]:
    """The limits of a table of the budgets."""
    return dict(tomllib.loads(BUDGETS.read_text(encoding="utf-8"))[table])


@cache
def parsed(path: Path) -> ast.Module:
    """The syntax tree of a file."""
    return ast.parse(path.read_text(encoding="utf-8"))


def totals() -> dict[str, int]:
    """The measured size of what `[package]` of the budgets limits."""
    paths = sorted(PACKAGE.rglob("*.py"))
    trees = {path: parsed(path) for path in paths}
    lines = sum(lines_of(path) for path in paths)
    classes = Counter(node.name for tree in trees.values() for node in ast.walk(tree) if isinstance(node, ast.ClassDef))
    stems = Counter(path.stem for path in paths if path.stem not in ("__init__", "__main__"))
    functions = [
        node
        for tree in trees.values()
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    ]
    imported = sum(_lines_spent_on_imports(tree) for tree in trees.values())
    return {
        "lines": lines,
        "lines_of_code": sum(code_of(path) for path in paths),
        "modules": len(paths),
        "class_names_twice": sum(count > 1 for count in classes.values()),
        "module_names_twice": sum(count > 1 for count in stems.values()),
        "import_permille": round(1000 * imported / lines),
        "longest_function": max(_body_of(node) for node in functions),
        "test_lines": sum(lines_of(path) for path in (ROOT / "tests").rglob("*.py")),
        "document_words": sum(len(path.read_text(encoding="utf-8").split()) for path in documents()),
    }


def documents() -> Iterator[Path]:
    """The READMEs: what a person reads of the house."""
    yield ROOT / "README.md"
    for folder in ("frictionlab", "tests", "configs", "sample_data"):
        yield from (path for path in sorted((ROOT / folder).rglob("*.md")) if path.parent.name != "results")


def lines_of(path: Path) -> int:
    """Lines of a file."""
    return path.read_text(encoding="utf-8").count("\n")


def code_of(path: Path) -> int:
    """Lines of a file that hold code: neither blank nor comment nor docstring."""
    text = path.read_text(encoding="utf-8")
    strings: set[int] = set()
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            strings.update(range(node.lineno, (node.end_lineno or 0) + 1))
    lines = enumerate(map(str.strip, text.splitlines()), 1)
    return sum(bool(line) and not line.startswith("#") and number not in strings for number, line in lines)


@cache
def _recording() -> Path:
    """The log, ingested once."""
    recording = Path(tempfile.mkdtemp()) / "steel.h5"
    ingest = [sys.executable, "-m", "frictionlab", "ingest", LOG, *SCENE, "-o", str(recording), "--quiet"]
    subprocess.run(ingest, check=True, cwd=ROOT, capture_output=True)
    return recording


def modules_executed(command: str, arguments: tuple[str, ...]) -> int:
    """How many modules of the package have a function that a command calls."""
    given = [str(_recording()) if word == "RECORDING" else word for word in arguments]
    run = [sys.executable, "-c", COUNT, str(PACKAGE), command, *given]
    done = subprocess.run(run, capture_output=True, text=True, check=True, cwd=ROOT)
    return int(done.stderr.split()[-1])


def _body_of(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of a function's body, without its docstring."""
    body = node.body[1:] if ast.get_docstring(node) else node.body
    return (body[-1].end_lineno or 0) - body[0].lineno + 1 if body else 0


def _lines_spent_on_imports(tree: ast.Module) -> int:
    """Lines of imports and of `__all__`."""
    spent = 0
    for node in ast.walk(tree):
        names = [t.id for t in node.targets if isinstance(t, ast.Name)] if isinstance(node, ast.Assign) else []
        if isinstance(node, ast.Import | ast.ImportFrom) or (isinstance(node, ast.Assign) and "__all__" in names):
            spent += (node.end_lineno or 0) - node.lineno + 1
    return spent


def main() -> None:
    """Print the sizes of each folder, then the totals beside their budgets."""
    for folder in sorted({path.relative_to(PACKAGE).parts[0] for path in PACKAGE.rglob("*.py")}):
        paths = [path for path in PACKAGE.rglob("*.py") if path.relative_to(PACKAGE).parts[0] == folder]
        lines, code = sum(lines_of(p) for p in paths), sum(code_of(p) for p in paths)
        print(f"{folder:24} {lines:6} lines {code:6} of code {len(paths):4} modules")
    limits = budgets()
    for name, value in totals().items():
        print(f"{name:24} {value:6}, at most {limits[name]}")
    for command, arguments in COMMANDS.items():
        print(f"{command:24} {modules_executed(command, arguments):6} modules, at most {budgets('executed')[command]}")


if __name__ == "__main__":
    main()
