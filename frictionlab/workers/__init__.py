"""The same work on one core, on all of this machine, or on a cluster: same rows, same order, nothing lost.

    cases --batches--> workers (this process | processes here | Dask) --in order--> results

What is measured about it, and what a billion cases would take, stands in the README of this folder.
"""

from frictionlab.workers.ledger import Batch
from frictionlab.workers.run import Lost, run_batches, run_each

__all__ = ["Batch", "Lost", "run_batches", "run_each"]
