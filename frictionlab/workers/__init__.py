"""The same work on one core, on all of this machine, or on a cluster: same rows, same order, nothing lost.

cases --batches--> workers (this process | processes here | Dask) --in order--> results
"""

from frictionlab.workers.run import Batch as Batch
from frictionlab.workers.run import Lost as Lost
from frictionlab.workers.run import run_batches as run_batches
from frictionlab.workers.run import run_each as run_each
