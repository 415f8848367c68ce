"""Two bundles beside each other: what went into them, and what came out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studio.options import option_text
from studio.progress import duration_text

if TYPE_CHECKING:
    from studio.manifest import Manifest
    from studio.summary import Summary

__all__ = ["Comparison", "Difference", "compare_bundles"]

_FIGURES: tuple[tuple[str, str, int], ...] = (
    ("completion", "folded, %", 1), ("shape_rms_mm", "shape rms, mm", -1), ("edits", "net edits", -1),
    ("rotations", "rotations", -1), ("clipped_area_mm2", "clipped, mm²", -1), ("passes", "passes", -1),
    ("seconds", "machine time", -1), ("energy_j", "energy, J", -1),
)  # fmt: skip
"""Field of the summary, its name, and whether more is better (1) or worse (-1)."""

_STATES = (
    ("base_face", "base face"),
    ("tree", "blooming tree"),
    ("verdict", "verdict"),
    ("replay", "replay"),
)


@dataclass(frozen=True)
class Difference:
    """One thing in two bundles.

    Attributes:
        name: what it is.
        first: its value in the first bundle, as text.
        second: in the second.
        better: 1 or 2 where one of them is better, 0 where they are equal or where there is no better.
    """

    name: str
    first: str
    second: str
    better: int = 0


@dataclass(frozen=True)
class Comparison:
    """What two bundles have in common and what they have not.

    Attributes:
        inputs: what went in and differs: mesh, rig, material, seed, parameters, versions.
        figures: what came out, equal or not.
        blocked_first: creases that only the first leaves short.
        blocked_second: creases that only the second leaves short; both are empty for different goals.
        files: names of the files that differ, or that only one has.
        same_goal: whether both fold the same mesh.
    """

    inputs: tuple[Difference, ...]
    figures: tuple[Difference, ...]
    blocked_first: tuple[int, ...]
    blocked_second: tuple[int, ...]
    files: tuple[str, ...]
    same_goal: bool

    def to_values(self) -> dict[str, Any]:
        """Plain values for JSON."""
        from dataclasses import asdict

        return {"format": "metal-blossom/comparison", "version": 1, **asdict(self)}


def compare_bundles(first: Path, second: Path) -> Comparison:
    """Compare two bundles; both are only read.

    Raises:
        BundleError: if one of them is no bundle or was changed.
    """
    from studio.bundle_check import open_manifest
    from studio.bundle_summary import bundle_summary
    from studio.workspace import Workspace

    spaces = [Workspace(folder, open_manifest(folder)) for folder in (first, second)]
    one, two = (bundle_summary(ws) for ws in spaces)
    m1, m2 = (ws.manifest for ws in spaces)
    same_goal = _hash(m1, "goal.ply") == _hash(m2, "goal.ply")
    same_net = _hash(m1, "net.fold") == _hash(m2, "net.fold")
    short = [{int(b["crease"]) for b in summary.blocked} for summary in (one, two)]
    return Comparison(
        inputs=tuple(_inputs(m1, m2)),
        figures=tuple(d if same_goal else replace(d, better=0) for d in _figures(one, two)),
        blocked_first=tuple(sorted(short[0] - short[1])) if same_net else (),
        blocked_second=tuple(sorted(short[1] - short[0])) if same_net else (),
        files=tuple(n for n in sorted({*m1.files, *m2.files}) if _hash(m1, n) != _hash(m2, n)),
        same_goal=same_goal,
    )


def _hash(manifest: Manifest, name: str) -> str:
    return str(manifest.files.get(name, {}).get("sha256", ""))


def _inputs(one: Manifest, two: Manifest) -> list[Difference]:
    pairs = [
        ("mesh", _named(one.input), _named(two.input)),
        ("rig", _named(one.rig), _named(two.rig)),
        ("material", _named(one.material), _named(two.material)),
        ("thickness", *(f"{m.material.get('thickness_mm', 0):g} mm" for m in (one, two))),
        ("seed", str(one.seed), str(two.seed)),
    ]
    pairs += [
        (f"{stage} {key.replace('_', ' ')}", option_text(a), option_text(b))
        for stage, key, a, b in _leaves(one.parameters, two.parameters)
    ]
    pairs += [
        (name, option_text(one.versions.get(name)), option_text(two.versions.get(name)))
        for name in sorted({*one.versions, *two.versions})
    ]
    return [Difference(name, a, b) for name, a, b in pairs if a != b]


def _leaves(
    one: Mapping[str, Mapping[str, Any]], two: Mapping[str, Mapping[str, Any]]
) -> list[tuple[str, str, Any, Any]]:
    """(stage, name, first, second) of every parameter that both stages ran with."""
    return [
        (stage, key, one[stage].get(key), two[stage].get(key))
        for stage in sorted({*one} & {*two})
        for key in sorted({*one[stage], *two[stage]})
        if key not in ("seed", "path")
    ]


def _named(values: Mapping[str, Any]) -> str:
    """Name and the beginning of the hash of an input."""
    return f"{values.get('name', '-')} ({str(values.get('sha256', ''))[:8]})"


def _figures(one: Summary, two: Summary) -> list[Difference]:
    rows = []
    for field, name, sign in _FIGURES:
        a, b = getattr(one, field), getattr(two, field)
        better = 0
        if a is not None and b is not None and a != b:
            better = 1 if (a - b) * sign > 0 else 2
        rows.append(Difference(name, _figure(field, a), _figure(field, b), better))
    short = len(one.blocked), len(two.blocked)
    rows.insert(2, Difference("creases short", str(short[0]), str(short[1]), _fewer(*short)))
    return rows + [
        Difference(name, option_text(getattr(one, f)), option_text(getattr(two, f))) for f, name in _STATES
    ]


def _fewer(one: int, two: int) -> int:
    return 0 if one == two else 1 if one < two else 2


def _figure(field: str, value: float | None) -> str:
    if value is None:
        return "-"
    if field == "completion":
        return f"{100.0 * value:.2f}"
    if field == "seconds":
        return duration_text(value)
    return str(value) if isinstance(value, int) else f"{value:.3f}" if abs(value) < 10 else f"{value:.0f}"
