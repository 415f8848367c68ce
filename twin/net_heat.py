"""How warm each crease of a net is while passes are burnt, one after another, all over it.

The field is marched on a coarse mesh. What the mesh cannot show, the first moments after a pass, has a closed
form: the line source in a wide plate, corrected more and more for what the ends of the crease and cuts beside
it change. Once the heat has spread over a triangle side it is handed to the mesh with the profile that it has
by then. Heat of other creases counts at once with that profile.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.net import Net
from rigs.material import Material
from twin.cooling import AMBIENT_C, crease_rise
from twin.errors import HeatingError
from twin.thermal_field import ThermalField
from twin.thermal_mesh import ThermalMesh, net_mesh

__all__ = ["SIDE_MM", "NetHeat"]

SIDE_MM = 3.0
"""Longest triangle side of the mesh."""

LEAST_SPREAD_S = 0.25
"""The closed form counts at least this long after a pass."""

_LONGEST_WAIT_S = 3600.0
_WAIT_DIGIT_S = 1e-3


@dataclass(frozen=True)
class _Pass:
    """A pass whose heat the mesh does not hold yet."""

    begun_s: float
    crease: int
    joules: float


class NetHeat:
    """The heat in a net, pass by pass. Times only go forward.

    Args:
        net: the net.
        material: what the sheet is made of.
        thickness_mm: of the sheet.
        mesh: a finer mesh, or one with the sheet; the net alone, insulated all around, when None: that is
            the warmer, safe side, since the tabs lead heat away.
        side_mm: longest triangle side of that mesh.

    Attributes:
        now_s: time of the last pass or wait.
        spread_s: how long the closed form counts.
    """

    def __init__(
        self, net: Net, material: Material, thickness_mm: float, *, mesh: ThermalMesh | None = None,
        side_mm: float = SIDE_MM,
    ) -> None:  # fmt: skip
        self.net, self.material, self.thickness_mm = net, material, thickness_mm
        self.field = ThermalField(net_mesh(net, side_mm) if mesh is None else mesh, material, thickness_mm)
        self.spread_s = max(side_mm**2 / (2.0 * self.field.diffusivity), LEAST_SPREAD_S)
        self.step_s = self.spread_s / 2.0
        self.now_s = 0.0
        self._spreads: dict[int, NDArray[np.float64]] = {}
        self._beyond: dict[int, float] = {}
        self._reach: dict[tuple[int, int], float] = {}
        self._lines: dict[int, tuple[NDArray[np.int64], NDArray[np.float64]]] = {}
        self._length: dict[int, float] = {}
        self._pending: deque[_Pass] = deque()
        self._grid = 0
        self._known = (-1, -1, 0.0, 0.0)
        self._here = self.field.rise.copy()
        self._next = self._here
        tau = self.field.loss_s
        one = float(crease_rise(np.ones(1), 1.0, thickness_mm, material)[0])
        self._scale, self._tau = one * math.exp(1.0 / tau), tau

    def copy(self) -> NetHeat:
        """The same heat, to be marched on independently; meshes and factors are shared."""
        twin = object.__new__(NetHeat)
        twin.__dict__.update(self.__dict__)
        twin._pending = self._pending.copy()
        return twin

    def rise(self, crease: int, at_s: float | None = None) -> float:
        """Mean rise of a crease (net edge) over the room, K, now or at a later time without further passes.

        Raises:
            HeatingError: if the crease is none of the net, or the time has passed.
        """
        if at_s is not None:
            self.wait_until(at_s)
        return self._rise_at(crease, self.now_s)

    def start_c(self, crease: int) -> float:
        """Mean temperature of a crease now, °C."""
        return AMBIENT_C + self.rise(crease)

    def burn(self, crease: int, line_j_m: float) -> None:
        """A pass of ``line_j_m`` absorbed joules per metre begins on a crease now; it is taken as instant."""
        self._line(crease)
        self._pending.append(_Pass(self.now_s, crease, 1e-3 * line_j_m * self._length[crease]))

    def wait_until(self, at_s: float) -> None:
        """Let time pass.

        Raises:
            HeatingError: if the time has passed.
        """
        if at_s < self.now_s - 1e-9:
            raise HeatingError(f"time {at_s:g} s has passed: it is {self.now_s:g} s")
        while at_s >= (self._grid + 1) * self.step_s:
            self._march()
        self.now_s = max(at_s, self.now_s)

    def wait_until_cold(self, crease: int, allowed_c: float) -> float:
        """Let time pass until a crease is at ``allowed_c`` or colder; returns the time in whole ms.

        Raises:
            HeatingError: if it is not within an hour: ``allowed_c`` is too near to the room's temperature.
        """
        allowed = allowed_c - AMBIENT_C
        began = self.now_s
        while self._rise_at(crease, self.now_s) > allowed:
            end = (self._grid + 1) * self.step_s
            if self._rise_at(crease, end) > allowed:
                if end - began > _LONGEST_WAIT_S:
                    raise HeatingError(
                        f"crease {crease} does not cool to {allowed_c:g} °C within an hour: "
                        "allow a warmer start"
                    )
                self._march()
                self.now_s = end
                continue
            low, high = self.now_s, end
            while high - low > 0.1 * _WAIT_DIGIT_S:
                middle = 0.5 * (low + high)
                low, high = (middle, high) if self._rise_at(crease, middle) > allowed else (low, middle)
            self.wait_until(max(math.ceil(high / _WAIT_DIGIT_S - 1e-6) * _WAIT_DIGIT_S, high))
        return self.now_s

    def _rise_at(self, crease: int, at_s: float) -> float:
        """Mean rise of a crease at a time between the two of the grid that are known."""
        share = at_s / self.step_s - self._grid
        if self._known[:2] != (self._grid, crease):
            on, weight = self._line(crease)
            ends = float(weight @ self._here[on]), float(weight @ self._next[on])
            self._known = (self._grid, crease, *ends)
        rise = (1.0 - share) * self._known[2] + share * self._known[3]
        for passed in self._pending:
            rise += passed.joules * self._felt(passed, crease, at_s)
        return rise

    def _march(self) -> None:
        """To the next time of the grid; heat that has spread by then is handed to the mesh."""
        self._grid += 1
        here = self._next.copy()
        at = self._grid * self.step_s
        while self._pending and self._pending[0].begun_s + self.spread_s <= at:
            passed = self._pending.popleft()
            here += passed.joules * self._spread(passed.crease)
        self._here = here
        self._next = self._crank_nicolson(here, self.step_s)

    def _line(self, crease: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        if crease not in self._lines:
            face = self.net.child_of.get(crease)
            if face is None:
                raise HeatingError(
                    f"net edge {crease} joins no face to its parent: it is no crease of this net"
                )
            start, end = self.net.hinge(face)
            self._lines[crease] = self.field.line(start, end)
            self._length[crease] = float(np.linalg.norm(end - start))
        return self._lines[crease]

    def _spread(self, crease: int) -> NDArray[np.float64]:
        """(V,) rise of one joule on a crease ``spread_s`` after it was put there."""
        if crease not in self._spreads:
            on, weight = self._line(crease)
            rise = np.zeros(len(self.field.rise))
            rise[on] = weight / self.field.capacity[on]
            for _ in range(2):  # implicit Euler first: it damps what the sharp line excites
                rise = self.field.stepped(rise, self.spread_s / 8.0)
            for _ in range(3):
                rise = self._crank_nicolson(rise, self.spread_s / 4.0)
            self._spreads[crease] = rise
            closed = self._alone(crease, self.spread_s)
            self._beyond[crease] = float(weight @ rise[on]) / closed - 1.0
        return self._spreads[crease]

    def _alone(self, crease: int, age_s: float) -> float:
        """Mean rise of a crease, K, by a joule burnt on it ``age_s`` ago if the plate had no end."""
        per_metre = self._scale * math.exp(-age_s / self._tau) / math.sqrt(age_s)
        return per_metre / (1e-3 * self._length[crease])

    def _crank_nicolson(self, rise: NDArray[np.float64], seconds: float) -> NDArray[np.float64]:
        """A step of second order, from an implicit one of half its length."""
        return 2.0 * self.field.stepped(rise, 0.5 * seconds) - rise

    def _felt(self, passed: _Pass, crease: int, at_s: float) -> float:
        """Mean rise on a crease, K, of a joule of a pass that the mesh does not hold yet."""
        if passed.crease == crease:
            self._spread(crease)
            age = max(at_s - passed.begun_s, 1e-6)
            # what the real ends and neighbours of the crease change grows with the way that heat has gone
            share = min(math.sqrt(age / self.spread_s), 1.0)
            return self._alone(crease, age) * (1.0 + self._beyond[crease] * share)
        pair = (passed.crease, crease)
        if pair not in self._reach:
            on, weight = self._line(crease)
            self._reach[pair] = float(weight @ self._spread(passed.crease)[on])
        return self._reach[pair]
