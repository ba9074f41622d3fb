"""The verbs: what the command line, `make` and a notebook call alike.

    ingest          log -> Recording
    analyze         log or recording -> Measurement
    compare         log, recording or measurement -> Comparison
    explain         the same -> Explanation: the law it requires, in a dozen lines
    free_vibration  log or recording of a free decay -> FreeVibration of each tap
    evaluate        measurements -> Campaign;  publish   Campaign -> tables, figures, report
    batch           a folder of logs -> all of these in files; only what changed is made again
    simulate        Problem -> SteadyState;  respond  recorded base + Problem -> RecordResponse
    predict         law_MATERIAL.toml -> Prediction of tests not made
    synthesize      Scene -> logs whose truth is known;  init   a folder of logs -> the scene they need
    plot            a result -> its figure

A verb takes paths (``str`` or `Path`) or results, a scene (a path, a `Scene` or nothing: all defaults) and, as
keywords, keys of the scene's tables that win over it; it returns a frozen result. What a verb honours of a scene
(``[log]``, ``[experiment]``) it honours for every caller.

``starting`` (init), ``one_test`` (ingest, analyze, compare, ...), ``simulating`` (with plan and predict), ``evaluate``,
``presenting`` and ``chain`` (batch) hold them; ``inputs``: what a verb may be given, and what becomes of an input that
fails. Nothing is imported here, and a verb imports what it needs when it is called. A new verb is a function there and
its name in `frictionlab` (``__init__.py`` and ``__init__.pyi``).
"""
