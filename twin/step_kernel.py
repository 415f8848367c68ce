"""Kernel that looks at all hinges after a time step.

One file on purpose: numba notices a change of the file in which a compiled function stands, and of no other.
"""

from __future__ import annotations

from planner._kernels.compiled import entry

__all__ = ["hinge_extremes"]


@entry
def hinge_extremes(angle, rest, address, rate, largest_rate):  # type: ignore[no-untyped-def]
    """Largest elastic angle without sign, and whether no hinge turns faster than allowed.

    Args:
        angle: (J,) angles.
        rest: (N,) state that holds the rest angles.
        address: (J,) where.
        rate: (J,) rates.
        largest_rate: allowed rate; one that is no number is not allowed either.
    """
    lag, within = 0.0, True
    for j in range(len(address)):
        lag = max(lag, abs(angle[j] - rest[address[j]]))
        within = within and abs(rate[j]) <= largest_rate
    return lag, within
