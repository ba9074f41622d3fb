"""The verbs: what the command line, `make` and a notebook call alike; the README here says their rules.

``one_test``: ingest, analyze, compare, explain, free_vibration, modes; ``evaluate``: evaluate and publish a campaign;
``chain``: batch; ``simulating``: simulate, respond, predict, plan, synthesize; ``starting``: init.
``inputs``: what a verb may be given, and what becomes of an input that fails. (`plot` is one of `frictionlab.figures`.)
"""
