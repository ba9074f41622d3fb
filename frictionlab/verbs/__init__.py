"""The verbs: what the command line, `make` and a notebook call alike.

    ingest       log -> Recording                       evaluate  measurements -> Campaign
    analyze      log or recording -> Measurement        publish   Campaign -> tables, figures, report
    compare      log, recording, measurement -> Comparison
    respond      recorded base + Problem -> RecordResponse
    simulate     Problem -> SteadyState                 synthesize  Scene -> logs whose truth is known
    plot         a result -> its figure                  batch     a folder of logs -> all of these; only what changed

A verb takes paths (``str`` or `Path`) or results, a scene (a path, a `Scene` or nothing: all defaults) and, as
keywords, keys of the scene's tables that win over it; it returns a frozen result. What a verb honours of a scene
(``[log]``, ``[experiment]``) it honours for every caller.

One verb, one module here, with one public function; its name and module stand in `frictionlab` (``__init__.py`` and
``__init__.pyi``). That is all a new verb needs. Nothing is imported here: each verb pays for its own needs alone.
"""
