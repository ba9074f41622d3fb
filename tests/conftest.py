"""What holds for all tests: property tests draw the same examples in every run; machine code is made once."""

import subprocess
import sys

import pytest
from hypothesis import settings

settings.register_profile("house", derandomize=True)
settings.load_profile("house")

COMPILE = """
from frictionlab.simulator import sweep
from frictionlab.simulator.{}engine import compiled
compiled()
sweep([0.5, 0.7], [0.2, 0.4], {})
"""
KERNELS = ("", ""), ("elastic.", "law='coulomb+compliance', parameters={'stiffness_ratio': 20.0}")


def pytest_configure(config: pytest.Config) -> None:
    """Have the kernels compiled side by side before several processes test: each would compile both by itself."""
    if getattr(config.option, "numprocesses", None) and not hasattr(config, "workerinput"):
        for started in [subprocess.Popen([sys.executable, "-c", COMPILE.format(*each)]) for each in KERNELS]:
            started.wait()
