"""``python -m frictionlab``: the command line, where no ``frictionlab`` stands on the path."""

from frictionlab.cli import main

main()
