"""The documents say what the program does: every command in them is run, every number in their output is compared."""

import contextlib
import re
import shlex
from dataclasses import dataclass
from pathlib import Path

import pytest

from frictionlab.cli import COMMANDS
from tests.desk import MAKE, ROOT, invoke, run_in, set_up
from tests.weigh import documents

NUMBER = re.compile(r"[-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?")
DOCUMENTS = list(documents())


@dataclass(frozen=True)
class Transcript:
    """A fenced ``console`` block: a command after ``$`` and what it printed; ``...`` stands for any lines."""

    document: Path
    line: int
    command: str
    output: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.document.relative_to(ROOT)}:{self.line}"


def transcripts(document: Path) -> list[Transcript]:
    found: list[Transcript] = []
    inside, command, at = False, "", 0
    output: list[str] = []
    for number, line in enumerate(document.read_text(encoding="utf-8").splitlines(), 1):
        if inside and (line.startswith(("$ ", "```"))) and command:
            found.append(Transcript(document, at, command, tuple(output)))
            command, output = "", []
        if line.startswith("```"):
            inside = line == "```console"
        elif inside and line.startswith("$ "):
            command, at = line[2:], number
        elif inside and line.strip():
            output.append(line)
    return found


ALL = [transcript for document in DOCUMENTS for transcript in transcripts(document)]
RUN = [t for t in ALL if t.command in ("make", "make help") or t.command.startswith("frictionlab ")]
SHOWN = [t for t in ALL if t not in RUN]


@pytest.fixture(scope="session")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder like a fresh clone, for commands that write; what one transcript made the next one finds."""
    return set_up(tmp_path_factory.mktemp("desk"), "configs", "sample_data")


def run(command: str, desk: Path) -> str:
    first, *words = shlex.split(command)
    with contextlib.chdir(desk):
        if first != "make":
            return invoke(*words, status=0).stdout
        done = run_in(desk, [*MAKE, "--silent", *words])
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.timeout(180)
def test_what_the_documents_show_is_what_the_commands_print(desk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    for transcript in RUN:
        lines = [line for line in run(transcript.command, desk).splitlines() if line.strip()]
        if transcript.output:
            assert_same(transcript, lines)


def assert_same(transcript: Transcript, lines: list[str]) -> None:
    """Words agree exactly, numbers to 1e-4; ``...`` skips to the next line that is shown."""
    rest = iter(lines)
    skipping = False
    for shown in transcript.output:
        if shown.strip() == "...":
            skipping = True
            continue
        agreed = (line for line in rest if same_line(shown, line)) if skipping else rest
        line = next(agreed, "(no more lines)")
        assert same_line(shown, line), f"{transcript}: the document shows {shown!r}; the command printed {line!r}"
        skipping = False


def same_line(shown: str, printed: str) -> bool:
    words, numbers = NUMBER.sub("#", shown).split(), NUMBER.findall(shown)
    if words != NUMBER.sub("#", printed).split():
        return False
    pairs = zip(numbers, NUMBER.findall(printed), strict=True)
    return all(float(a) == pytest.approx(float(b), rel=1e-4, abs=1e-12) for a, b in pairs)


@pytest.mark.parametrize("transcript", SHOWN, ids=str)
def test_a_command_that_is_only_shown_is_a_real_target(transcript: Transcript) -> None:
    words = shlex.split(transcript.command, comments=True)
    if words[0] == "make":
        targets = [w for w in words[1:] if "=" not in w and not w.startswith("-")]
        makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
        assert all(re.search(rf"^{t}:", makefile, re.MULTILINE) for t in targets)
    else:
        assert words[0] in {"git", "cd", "python3", "dask", "sbatch"}


def test_the_readme_names_every_command_and_every_target() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    targets = re.findall(r"^([a-z0-9-]+):.*## ", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    assert not [name for name in COMMANDS if f"frictionlab {name}" not in readme]
    assert not [target for target in targets if target != "all" and f"make {target}" not in readme]


def test_the_house_maps_every_part() -> None:
    readme = (ROOT / "frictionlab" / "README.md").read_text(encoding="utf-8")
    parts = [p for p in (ROOT / "frictionlab").iterdir() if p.suffix == ".py" or (p.is_dir() and any(p.glob("*.py")))]
    names = [f"{p.name}/" if p.is_dir() else p.name for p in parts if p.name != "__init__.py"]
    assert not [name for name in names if f" {name}" not in readme]


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda p: str(p.relative_to(ROOT)))
def test_links_and_pictures_in_documents_exist(document: Path) -> None:
    links = re.findall(r"\]\(([^)#]+)[^)]*\)", document.read_text(encoding="utf-8"))
    missing = [link for link in links if "://" not in link and not (document.parent / link).exists()]
    assert not missing
