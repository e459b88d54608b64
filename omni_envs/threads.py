"""Threads of the maths libraries.

Those of several processes fight for the cores; and on small matrices they only wait for each other,
which takes fifty times as long where another program keeps a core busy.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

from threadpoolctl import threadpool_limits

_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@contextmanager
def one_maths_thread() -> Iterator[None]:
    """Has processes that are started within use one thread: libraries read this at their import."""
    before = {name: os.environ.get(name) for name in _VARIABLES}
    os.environ.update(dict.fromkeys(_VARIABLES, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


@contextmanager
def one_maths_thread_here() -> Iterator[None]:
    """Has the linear algebra of this process use one thread."""
    with threadpool_limits(1, user_api="blas"):
        yield
