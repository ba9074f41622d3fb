"""One home for every column: no two heads alike, one meaning a name, and a sentence that the documents repeat."""

import ast
from dataclasses import fields
from pathlib import Path

import pytest

from frictionlab.analysis.free_vibration import FreeVibration
from frictionlab.scene.text import template
from frictionlab.schema import (
    DRIFTS,
    ENERGY,
    FREE_VIBRATIONS,
    RANKING,
    STEADY_STATES,
    TABLES,
    TRADES,
    Table,
    Type,
    column_of,
    is_marked,
    table_of,
)
from frictionlab.simulator.state import KEYS
from frictionlab.tradeoff import Setting
from tests.documents import KEYS as KEYS_FILE

EACH = pytest.mark.parametrize("table", TABLES, ids=lambda t: t.kind)


@EACH
def test_a_table_names_and_describes_each_column_once_and_shows_some(table: Table) -> None:
    for words in (table.names, [c.title for c in table.columns], [c.head for c in table.columns]):
        assert len(set(words)) == len(words)

    for column in (*table.columns, *table.series):
        assert column.sentence[0] in "`(" or column.sentence[0].isupper()
        assert column.sentence.endswith((".", ")", ".)", "..."))
        assert len(column.title) <= 20

    assert set(table.shown) <= set(table.names)
    assert 4 <= table.lead <= len(table.columns)


def test_a_name_means_the_same_everywhere_and_says_its_unit() -> None:
    types: dict[str, set[Type]] = {}
    for column in (column for table in TABLES for column in table.columns):
        types.setdefault(column.name, set()).add(column.type)
    assert not {name for name, found in types.items() if len(found) > 1}
    ends = {"Hz": "_hz", "s": "_s", "m": "_m", "N": "_n", "J": "_j"}
    strangers = {"seconds", "wall_s"}
    for column in (column for table in TABLES for column in table.columns):
        name = column.error_of or column.name.removesuffix("_upper")
        if column.unit in ends and column.name not in strangers:
            assert name.endswith(ends[column.unit]), column.name


@EACH
def test_a_table_is_known_by_all_of_its_first_columns(table: Table) -> None:
    assert is_marked(table.names, table)
    assert not is_marked(table.names[1:], table)
    assert not is_marked(("log", *table.names), table)
    assert table_of(table.names) is table
    assert table_of((*reversed(table.names), "my own")) is table


def test_nobody_elses_table_is_taken_for_one() -> None:
    assert table_of(("log", "material", "normal_force_n", "source")) is None
    assert column_of("my own") is None


def test_the_list_of_keys_is_in_step() -> None:
    assert KEYS_FILE.read_text(encoding="utf-8") == template(), "run: python -m tests.documents"


def test_results_have_a_column_for_each_of_their_keys() -> None:
    assert STEADY_STATES.names == KEYS
    assert TRADES.names == tuple(f.name for f in fields(Setting))
    drawn = {"time", "measured", "fitted", "unit"}
    assert {f.name for f in fields(FreeVibration)} - drawn <= set(FREE_VIBRATIONS.names)
    assert RANKING.mark == ("criterion", "rank", "material", "value", "value_se")
    assert "slope_per_hour" in DRIFTS.names


def test_a_column_is_renamed_in_the_schema_alone() -> None:
    """Elsewhere its name stands for attributes of results, which stay: repeated in a comparison, and of a contact."""
    package = Path(__file__).parents[1] / "frictionlab"
    attributes = {"inference/compare.py", "cli/simulate.py", "simulator/state.py"}
    naming = {
        path.relative_to(package).as_posix()
        for path in package.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
        if ENERGY in node.value and not set(" \n") & set(node.value)
    }
    assert naming == {"schema/__init__.py", *attributes}
