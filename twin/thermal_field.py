"""The temperature of the flat net: heat that laser passes leave spreads in the plane and is lost to the air.

``rho c h dT/dt = div(k h grad T) - 2 (h_c + h_r) (T - T_a) + line sources``: linear finite elements on the
flat net (folding changes no distance in the metal), implicit Euler steps, one factorisation per step length.
The temperature is even through the sheet, which holds after some h² / a: milliseconds. Source of the
equation: Carslaw and Jaeger, Conduction of Heat in Solids, 1959, §1.8 and §4.1.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigs.material import Material
from twin.cooling import loss_time_s
from twin.errors import HeatingError
from twin.hot_metal import HotMetal
from twin.thermal_mesh import ThermalMesh, crease_line

__all__ = ["ThermalField"]

MEAN_C = 100.0
"""Conductivity and heat capacity are taken at this temperature, as for the single crease."""


class ThermalField:
    """Temperature rise over the room on a mesh of the flat metal.

    Args:
        mesh: triangles, tabs and clamps.
        material: what the sheet is made of.
        thickness_mm: of the sheet.
        loss: False: no heat leaves the metal but through clamps.

    Attributes:
        mesh: the mesh.
        diffusivity: a = k / (rho c), mm²/s.
        capacity: (V,) heat capacity of every vertex, J/K.
        rise: (V,) temperature rise over the room, K; may be replaced.

    Raises:
        HeatingError: if the thickness is not above zero or a triangle has no area.
    """

    def __init__(
        self, mesh: ThermalMesh, material: Material, thickness_mm: float, *, loss: bool = True
    ) -> None:
        if not thickness_mm > 0.0:
            raise HeatingError(f"thickness {thickness_mm:g} mm: expected a length above 0")
        metal = HotMetal.at(material, MEAN_C)
        self.mesh = mesh
        self.diffusivity = 1e6 * metal.diffusivity
        sheet_j_k = 1e-9 * metal.heat_capacity * thickness_mm  # J/(K mm²)
        self.sheet_j_k = sheet_j_k
        self.loss_s = loss_time_s(material, thickness_mm) if loss else np.inf
        area, stiffness = _assembled(mesh)
        if len(area) and not (area > 0.0).all():
            bad = int(np.argmin(area))
            raise HeatingError(
                f"vertex {bad} of the thermal mesh has no area around it: the net has a sliver"
            )
        self.capacity: NDArray[np.float64] = sheet_j_k * area
        self._conductance = (sheet_j_k * self.diffusivity) * stiffness
        self._factors: dict[float, Any] = {}
        self.rise = np.zeros(len(area))

    @property
    def energy_j(self) -> float:
        """Heat in the metal, J over that at room temperature."""
        return float(self.capacity @ self.rise)

    def line(
        self, start: NDArray[np.float64], end: NDArray[np.float64], among: int | None = None
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Vertices on a crease and their weights, for ``deposit`` and ``mean_rise``."""
        return crease_line(self.mesh, start, end, len(self.rise) if among is None else among)

    def deposit(self, line: tuple[NDArray[np.int64], NDArray[np.float64]], joules: float) -> None:
        """Put ``joules`` of heat on a line at once, evenly along it."""
        on, weight = line
        self.rise[on] += joules * weight / self.capacity[on]

    def mean_rise(self, line: tuple[NDArray[np.int64], NDArray[np.float64]]) -> float:
        """Mean rise along a line, K."""
        on, weight = line
        return float(weight @ self.rise[on])

    def advance(self, seconds: float, steps: int = 1) -> None:
        """Let ``seconds`` pass in equal implicit steps."""
        for _ in range(steps):
            self.rise = self.stepped(self.rise, seconds / steps)

    def stepped(self, rise: NDArray[np.float64], seconds: float) -> NDArray[np.float64]:
        """What becomes of ``rise`` ((V,) or (V, N)) in one implicit Euler step of ``seconds``."""
        if seconds not in self._factors:
            self._factors[seconds] = self._factor(seconds)
        after: NDArray[np.float64] = self._factors[seconds](rise)
        return after

    def _factor(self, seconds: float) -> Any:  # noqa: ANN401  scipy has no types
        from scipy.sparse import diags
        from scipy.sparse.linalg import splu

        free = ~self.mesh.clamped
        capacity = self.capacity[free]
        system = diags(capacity * (1.0 + seconds / self.loss_s)) + seconds * self._conductance[free][:, free]
        solve = splu(system.tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve
        if free.all():
            return functools.partial(_solved, solve, capacity)
        return functools.partial(_solved_free, solve, capacity, free)


def _solved(solve: Any, capacity: NDArray[np.float64], rise: NDArray[np.float64]) -> NDArray[np.float64]:  # noqa: ANN401
    after: NDArray[np.float64] = solve((capacity * rise.T).T)
    return after


def _solved_free(
    solve: Any,  # noqa: ANN401  scipy has no types
    capacity: NDArray[np.float64],
    free: NDArray[np.bool_],
    rise: NDArray[np.float64],
) -> NDArray[np.float64]:
    after = np.zeros_like(rise)
    after[free] = solve((capacity * rise[free].T).T)
    return after


def _assembled(mesh: ThermalMesh) -> tuple[NDArray[np.float64], Any]:
    """(V,) area that belongs to every vertex, mm², and the (V, V) stiffness of unit conductivity."""
    from scipy.sparse import coo_matrix

    count = len(mesh.vertices)
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    twice = np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    area = np.zeros(count)
    for k in range(3):
        np.add.at(area, mesh.triangles[:, k], twice / 6.0)
    opposite = np.stack([c - b, a - c, b - a], axis=1)
    local = np.einsum("tid,tjd->tij", opposite, opposite) / (2.0 * np.maximum(twice, 1e-300))[:, None, None]
    row = np.repeat(mesh.triangles, 3, axis=1).ravel()
    column = np.tile(mesh.triangles, (1, 3)).ravel()
    value = local.ravel()
    i, j = mesh.links[:, 0], mesh.links[:, 1]
    row = np.concatenate([row, i, j, i, j])
    column = np.concatenate([column, i, j, j, i])
    value = np.concatenate([value, mesh.link_ratio, mesh.link_ratio, -mesh.link_ratio, -mesh.link_ratio])
    return area, coo_matrix((value, (row, column)), shape=(count, count)).tocsr()
