"""Peak memory of this process."""

from __future__ import annotations

import contextlib
import sys


def peak_bytes() -> int | None:
    """Largest resident memory since the start of the process or ``reset_peak``; None if unknown."""
    try:
        # Not getrusage: there, a child starts with the peak of its parent.
        with open("/proc/self/status") as status:
            return next(int(row.split()[1]) * 1024 for row in status if row.startswith("VmHWM"))
    except (OSError, StopIteration):
        pass
    try:
        import resource
    except ImportError:  # Windows
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024


def resident_bytes() -> int | None:
    """Resident memory of now; None where the system does not tell."""
    try:
        with open("/proc/self/status") as status:
            return next(int(row.split()[1]) * 1024 for row in status if row.startswith("VmRSS"))
    except (OSError, StopIteration):
        return None


def reset_peak() -> int | None:
    """Forgets earlier peaks where the system can (Linux), and returns ``peak_bytes``.

    From here on the peak only grows, so a difference to the returned value is never negative.
    """
    with contextlib.suppress(OSError), open("/proc/self/clear_refs", "w") as switch:
        switch.write("5")
    return peak_bytes()
