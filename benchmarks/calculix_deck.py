"""Input decks for CalculiX: one laser pass over half a foil, heat first, then stresses.

The half plate lies at y >= 0, the crease along x at y = 0 is the plane of symmetry, the laser shines from +z.
Units in the decks are mm, N, s, tonnes, mW. Nothing of the product's heating models is used: only its
material profiles.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigs.material import Material

AMBIENT_C = 20.0
RUN_IN_RADII = 3.0
"""The spot starts and ends this many radii beyond the ends of the crease."""

LENGTH_RADII, WIDTH_RADII = 14.0, 12.0
"""Size of the half plate along and across the crease, in beam radii."""

STEPS_PER_RADIUS = 5
"""Time steps of the heat while the spot moves by one radius."""

COOLING_STEPS, COOLING_GROWTH = 18, 1.3
EVERY = 3
"""Temperatures of every so many time steps are handed to the mechanics."""

_PLASTIC_STRAINS = (0.0, 0.005, 0.01, 0.02, 0.04, 0.08, 0.15, 0.3, 0.6)


@dataclass(frozen=True)
class Pass:
    """One laser pass: metal, W, mm/s, mm (1/e² radius, thickness) and the absorbed share of the light."""

    name: str
    material: str
    power_w: float
    speed_mm_s: float
    radius_mm: float
    thickness_mm: float
    absorptivity: float = 0.35


@dataclass(frozen=True, eq=False)
class Mesh:
    """A box of bricks: node places along each axis, mm; node number = 1 + i + nx (j + ny k)."""

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    z: NDArray[np.float64]

    @property
    def points(self) -> NDArray[np.float64]:
        """(N, 3) node places in the order of their numbers."""
        z, y, x = np.meshgrid(self.z, self.y, self.x, indexing="ij")
        return np.column_stack([x.ravel(), y.ravel(), z.ravel()])

    def number(self, i: int, j: int, k: int) -> int:
        """Number of a node."""
        return 1 + i + len(self.x) * (j + len(self.y) * k)

    @property
    def bricks(self) -> NDArray[np.int64]:
        """(E, 8) nodes of the elements in CalculiX's order."""
        rows = [
            [
                self.number(i + a, j + b, k + c)
                for c in (0, 1)
                for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))
            ]
            for k in range(len(self.z) - 1)
            for j in range(len(self.y) - 1)
            for i in range(len(self.x) - 1)
        ]  # fmt: skip
        return np.array(rows)


def foil_mesh(case: Pass, finer: float = 1.0) -> Mesh:
    """Bricks half a beam radius long, a fifth wide at the crease and wider away from it, 4 layers.

    Args:
        case: the pass.
        finer: so many times as many elements along each axis.
    """
    w = case.radius_mm
    count = round(12 * finer)
    first, low, high = 0.2 * w / finer, 1.0001, 2.0
    for _ in range(80):
        ratio = 0.5 * (low + high)
        low, high = (
            (ratio, high) if first * (ratio**count - 1) / (ratio - 1) < WIDTH_RADII * w else (low, ratio)
        )
    widths = first * low ** np.arange(count)
    y = np.concatenate([[0.0], np.cumsum(widths)])
    y *= WIDTH_RADII * w / y[-1]
    return Mesh(
        x=np.linspace(0.0, LENGTH_RADII * w, round(28 * finer) + 1),
        y=y,
        z=np.linspace(0.0, case.thickness_mm, round(4 * finer) + 1),
    )


def beam_times(case: Pass) -> tuple[float, int]:
    """Time step and number of steps while the beam is on."""
    step = case.radius_mm / (STEPS_PER_RADIUS * case.speed_mm_s)
    return step, round((LENGTH_RADII + 2.0 * RUN_IN_RADII) * STEPS_PER_RADIUS)


def heat_deck(case: Pass, mesh: Mesh, material: Material) -> str:
    """Transient heat conduction under the moving Gaussian spot, temperature-dependent properties."""
    step, count = beam_times(case)
    lines = [*_model(mesh, "C3D8"), "*MATERIAL, NAME=METAL", "*CONDUCTIVITY"]
    table = material.table
    lines += [f"{k:.6g},{t:g}" for k, t in zip(table.conductivity_w_mk, table.temperature_c, strict=True)]
    lines += ["*SPECIFIC HEAT"]
    lines += [
        f"{1e6 * c:.6g},{t:g}" for c, t in zip(table.heat_capacity_j_kgk, table.temperature_c, strict=True)
    ]
    lines += [
        "*DENSITY",
        f"{1e-12 * material.density_kg_m3:.6g}",
        "*SOLID SECTION, ELSET=EALL, MATERIAL=METAL",
    ]
    lines += ["*INITIAL CONDITIONS, TYPE=TEMPERATURE", f"NALL,{AMBIENT_C:g}"]
    times = step * np.arange(count + 1)
    first = -RUN_IN_RADII * case.radius_mm
    shares = np.array(
        [hat_shares(mesh.x, first + case.speed_mm_s * t, case.radius_mm) for t in times.tolist()]
    )
    for i in range(len(mesh.x)):
        lines.append(f"*AMPLITUDE, NAME=A{i}, TIME=TOTAL TIME")
        lines += _rows([v for t, s in zip(times, shares[:, i], strict=True) for v in (t, s)])
    lines += ["*STEP, INC=100000", "*HEAT TRANSFER, DIRECT", f"{step:.9g},{step * count:.9g}"]
    across = hat_shares(mesh.y, 0.0, case.radius_mm)
    top = len(mesh.z) - 1
    absorbed_mw = 1e3 * case.absorptivity * case.power_w
    for i in range(len(mesh.x)):
        lines.append(f"*CFLUX, AMPLITUDE=A{i}")
        lines += [
            f"{mesh.number(i, j, top)},11,{absorbed_mw * share:.9g}"
            for j, share in enumerate(across)
            if share > 1e-9
        ]
    output = ["*NODE PRINT, NSET=NALL, FREQUENCY={}", "NT"]
    lines += [output[0].format(EVERY), output[1], "*END STEP"]
    for n in range(COOLING_STEPS):
        dt = step * COOLING_GROWTH ** (n + 1)
        lines += ["*STEP, INC=10", "*HEAT TRANSFER, DIRECT", f"{dt:.9g},{dt:.9g}", "*CFLUX, OP=NEW"]
        if n % 2:
            lines += [output[0].format(1), output[1]]
        lines.append("*END STEP")
    return "\n".join(lines) + "\n"


def stress_deck(
    mesh: Mesh, material: Material, temperatures: Sequence[NDArray[np.float64]], hardening_mpa: float
) -> str:
    """Elasto-plastic half plate through the given temperatures, and cold again at the end.

    Args:
        mesh: the same as of the heat.
        material: annealed sheet metal.
        temperatures: of all nodes, one array a step.
        hardening_mpa: saturation of the hardening of cold metal; it shrinks with the yield stress and is gone
            above the anneal temperature. Unlike in the product's section model, strain that was gained there
            counts again when the metal is cold.
    """
    lines = [*_model(mesh, "C3D8I"), "*MATERIAL, NAME=METAL", "*ELASTIC"]
    table = material.table
    lines += [
        f"{1e3 * e:.6g},{material.poisson:g},{t:g}"
        for e, t in zip(table.young_gpa, table.temperature_c, strict=True)
    ]
    lines.append(f"*EXPANSION, ZERO={AMBIENT_C:g}")
    lines += [
        f"{1e-6 * a:.6g},{t:g}" for a, t in zip(table.expansion_1e6_k, table.temperature_c, strict=True)
    ]
    lines.append("*PLASTIC")
    anneal = material.constants.anneal_c
    cold = material.value("yield_mpa", 20.0)
    for t in sorted({*table.temperature_c, anneal - 1.0, anneal + 1.0}):
        stress = material.value("yield_mpa", t)
        more = hardening_mpa * stress / cold if t < anneal else 0.0
        lines += [f"{stress + more * (1.0 - math.exp(-10.0 * p)):.6g},{p:g},{t:g}" for p in _PLASTIC_STRAINS]
    lines.append("*SOLID SECTION, ELSET=EALL, MATERIAL=METAL")
    lines += ["*INITIAL CONDITIONS, TYPE=TEMPERATURE", f"NALL,{AMBIENT_C:g}", "*BOUNDARY"]
    nx = len(mesh.x)
    lines += [
        f"{mesh.number(i, 0, k)},2,2" for k in range(len(mesh.z)) for i in range(nx)
    ]  # fmt: skip
    lines += [
        f"{mesh.number(0, 0, 0)},1,1",
        f"{mesh.number(0, 0, 0)},3,3",
        f"{mesh.number(nx - 1, 0, 0)},3,3",
    ]
    numbers = np.arange(1, len(mesh.points) + 1)
    for field in [*temperatures, np.full(len(numbers), AMBIENT_C)]:
        lines += ["*STEP, INC=400", "*STATIC", "0.34,1.,1e-5,1.", "*TEMPERATURE"]
        lines += [f"{n},{t:.3f}" for n, t in zip(numbers.tolist(), field.tolist(), strict=True)]
        lines += ["*NODE PRINT, NSET=FLANGE, FREQUENCY=1000", "U", "*END STEP"]
    return "\n".join(lines) + "\n"


def flange_places(mesh: Mesh) -> tuple[int, int]:
    """Indices along y of the two rows of nodes that tell how the flange leans."""
    far = len(mesh.y) - 1
    return min(int(np.searchsorted(mesh.y, 0.6 * mesh.y[-1])), far - 1), far


def hat_shares(places: NDArray[np.float64], centre: float, radius: float) -> NDArray[np.float64]:
    """Share of a Gaussian of 1/e² ``radius`` that falls to each hat function on ``places``."""
    sigma = 0.5 * radius
    nodes, weights = np.polynomial.legendre.leggauss(12)
    left, right = places[:-1], places[1:]
    at = 0.5 * (left + right)[:, None] + 0.5 * (right - left)[:, None] * nodes
    dense = np.exp(-0.5 * ((at - centre) / sigma) ** 2) / (sigma * math.sqrt(2.0 * math.pi))
    rising = (at - left[:, None]) / (right - left)[:, None]
    half = 0.5 * (right - left)
    share = np.zeros(len(places))
    share[1:] += half * ((dense * rising) @ weights)
    share[:-1] += half * ((dense * (1.0 - rising)) @ weights)
    return share


def _model(mesh: Mesh, kind: str) -> list[str]:
    lines = ["*NODE, NSET=NALL"]
    lines += [f"{n},{x:.9g},{y:.9g},{z:.9g}" for n, (x, y, z) in enumerate(mesh.points.tolist(), 1)]
    lines.append(f"*ELEMENT, TYPE={kind}, ELSET=EALL")
    lines += [f"{n}," + ",".join(map(str, row)) for n, row in enumerate(mesh.bricks.tolist(), 1)]
    lines.append("*NSET, NSET=FLANGE")
    lines += [f"{mesh.number(i, j, 0)}," for j in flange_places(mesh) for i in range(len(mesh.x))]
    return lines


def _rows(values: Iterable[float]) -> list[str]:
    """Comma-separated lines of eight."""
    texts = [f"{v:.6g}" for v in values]
    return [",".join(texts[n : n + 8]) for n in range(0, len(texts), 8)]
