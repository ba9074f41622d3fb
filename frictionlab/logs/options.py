"""The reader's options, which are the scene's ``[log]`` table: `frictionlab.log_options` is their home."""

from frictionlab.log_options import LogOptions

__all__ = ["LogOptions"]
