"""The file made from the program: ``python -m tests.documents`` writes it, a test compares."""

from pathlib import Path

from frictionlab.scene.text import template

KEYS = Path(__file__).parents[1] / "configs" / "all_keys.toml"

if __name__ == "__main__":
    KEYS.write_text(template(), encoding="utf-8", newline="\n")
