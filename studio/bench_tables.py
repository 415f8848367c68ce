"""Means, ratios and the Markdown page of ``blossom bench paper``."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from statistics import fmean
from typing import Any

from studio.bench_cases import ALL_RULES, BenchSettings, Row

__all__ = [
    "PAPER_AREA_PERCENT", "PAPER_PERCENT", "area_ratio", "case_mean", "combinations", "common_meshes",
    "headline", "label", "markdown", "mesh_mean",
]  # fmt: skip

PAPER_PERCENT = {("nb", "fp"): 96.08, ("ga", "fp"): 75.47, ("nb", "mp"): 46.87, ("ga", "mp"): 13.31}
"""Mean fold completion that the paper reports (Fig. S13), by net and planner."""

PAPER_AREA_PERCENT = 71.80
"""Clipped area of its NB nets over that of its GA nets (Fig. S14)."""


def label(net: str, planner: str) -> str:
    """``NB + FP`` and the like."""
    return f"{net.upper()} + {planner.upper() if len(planner) <= 2 else planner}"


def combinations(rows: Iterable[Row]) -> list[tuple[str, str]]:
    """Nets and planners that occur: those of the paper first."""
    found = {(row.net, row.planner) for row in rows}
    others = sorted(found - set(PAPER_PERCENT), key=lambda pair: (pair[1], pair[0] != "nb", pair[0]))
    return [pair for pair in PAPER_PERCENT if pair in found] + others


def mesh_mean(rows: Iterable[Row], figure: Callable[[Row], float | None]) -> float | None:
    """Mean of a figure over the rows that have it; None if none has."""
    values = [value for row in rows if (value := figure(row)) is not None]
    return fmean(values) if values else None


def case_mean(
    rows: Sequence[Row], net: str, planner: str, variant: str, *, missing_is_zero: bool = False
) -> tuple[float | None, int, int]:
    """Mean completion over meshes (each the mean over its seeds), meshes with a figure, meshes tried."""
    by_mesh: dict[str, list[Row]] = {}
    for row in rows:
        if (row.net, row.planner, row.variant) == (net, planner, variant) and row.status != "bad mesh":
            by_mesh.setdefault(row.mesh, []).append(row)

    def completion(row: Row) -> float | None:
        return 0.0 if row.completion is None and missing_is_zero else row.completion

    means = [mesh_mean(group, completion) for group in by_mesh.values()]
    with_figure = [mean for mean in means if mean is not None]
    folded = sum(any(row.completion is not None for row in group) for group in by_mesh.values())
    return (fmean(with_figure) if with_figure else None), folded, len(by_mesh)


def common_meshes(rows: Sequence[Row], pairs: Sequence[tuple[str, str]]) -> set[str]:
    """Meshes that have a plan, with all rules, by each of these nets and planners."""
    folded = {
        (row.net, row.planner, row.mesh)
        for row in rows
        if row.variant == ALL_RULES and row.completion is not None
    }
    meshes = {row.mesh for row in rows}
    return {mesh for mesh in meshes if all((*pair, mesh) in folded for pair in pairs)}


def area_ratio(rows: Sequence[Row], planner: str, variant: str = ALL_RULES) -> tuple[float | None, int]:
    """Clipped area on NB nets over that on GA nets, summed over pairs that have plans; and the pairs."""
    area: dict[tuple[str, str, int], float] = {
        (row.net, row.mesh, row.seed): row.clipped_area_mm2
        for row in rows
        if row.planner == planner and row.variant == variant and row.clipped_area_mm2 is not None
    }
    pairs = [(mesh, seed) for net, mesh, seed in area if net == "nb" and ("ga", mesh, seed) in area]
    ga = sum(area["ga", mesh, seed] for mesh, seed in pairs)
    nb = sum(area["nb", mesh, seed] for mesh, seed in pairs)
    return (nb / ga if ga > 0.0 else None), len(pairs)


def headline(rows: Sequence[Row]) -> dict[str, Any]:
    """Mean completion in percent of every net and planner with all rules, and the ratio of areas."""
    out: dict[str, Any] = {}
    common = common_meshes(rows, combinations(rows))
    shared = [row for row in rows if row.mesh in common]
    for net, planner in combinations(rows):
        mean, meshes, tried = case_mean(rows, net, planner, ALL_RULES)
        zero, _, _ = case_mean(rows, net, planner, ALL_RULES, missing_is_zero=True)
        out[label(net, planner)] = {
            "mean_percent": _percent_value(mean),
            "mean_percent_on_common_meshes": _percent_value(case_mean(shared, net, planner, ALL_RULES)[0]),
            "mean_percent_missing_as_zero": _percent_value(zero),
            "meshes_with_plan": meshes,
            "meshes": tried,
            "paper_percent": PAPER_PERCENT.get((net, planner)),
        }
    ratio, pairs = area_ratio(rows, "fp")
    out["clipped area NB : GA"] = {
        "percent": _percent_value(ratio),
        "pairs": pairs,
        "paper_percent": PAPER_AREA_PERCENT,
    }
    return out


def markdown(rows: Sequence[Row], settings: BenchSettings, command: str) -> str:
    """The whole page."""
    variants = [v for v in settings.variants if any(row.variant == v for row in rows)]
    first = variants[0] if variants else ALL_RULES
    meshes = sorted({row.mesh for row in rows})
    seeds = sorted({row.seed for row in rows})
    parts = [
        "# The paper's comparison\n",
        f"`{command}`\n",
        f"Meshes of at most {settings.max_faces} faces: {len(meshes)}; seeds: {len(seeds)}. NB: nearly-"
        "blooming nets, GA: nets of the genetic algorithm; FP: the fold planner on that one net, MP: the "
        "traditional motion planner. Completion is the folded share of all angles. linear, uniform and "
        "rrt-connect turn all creases at once and know no rule but contact. The paper's figures are those "
        "of its own meshes, nets and machine: they stand beside ours, they are not of the same input.\n",
        "## Mean completion, all rules\n",
        *_headline_table(rows),
        "",
        _area_words(rows),
        "",
        "## One rule left out at a time\n",
        "Mean completion in percent over meshes with a plan. `flips`: the rotary only turns by 180°. The "
        "rules outside-in and side cannot be left out: no planner here knows another way to turn a crease.\n",
        *_variant_table(rows, variants),
        "",
        "## Each mesh\n",
        f"Completion in percent ({first}), mean over seeds; clipped area in mm² of the fold planner.\n",
        *_mesh_table(rows, first),
        "",
        "## Without a result\n",
        *_failures(rows),
    ]
    return "\n".join(parts) + "\n"


def _headline_table(rows: Sequence[Row]) -> list[str]:
    common = common_meshes(rows, combinations(rows))
    shared = [row for row in rows if row.mesh in common]
    lines = [
        f"| net + planner | paper % | mean % | on the {len(common)} meshes that all fold % | "
        "missing as 0 % | meshes with a plan | shape rms mm |",
        "|---|---|---|---|---|---|---|",
    ]
    for net, planner in combinations(rows):
        mean, meshes, tried = case_mean(rows, net, planner, ALL_RULES)
        zero, _, _ = case_mean(rows, net, planner, ALL_RULES, missing_is_zero=True)
        chosen = [row for row in rows if (row.net, row.planner, row.variant) == (net, planner, ALL_RULES)]
        shape = mesh_mean(chosen, lambda row: row.shape_rms_mm)
        paper = PAPER_PERCENT.get((net, planner))
        cells = [
            label(net, planner),
            "–" if paper is None else f"{paper:.2f}",
            _percent(mean),
            _percent(case_mean(shared, net, planner, ALL_RULES)[0]),
            _percent(zero),
            f"{meshes} of {tried}",
            "–" if shape is None else f"{shape:.2f}",
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def _area_words(rows: Sequence[Row]) -> str:
    ratio, pairs = area_ratio(rows, "fp")
    if ratio is None:
        return (
            f"Clipped area NB : GA: no pair of plans that clip anything. Paper: {PAPER_AREA_PERCENT:.2f} %."
        )
    return (
        f"Clipped area NB : GA with the fold planner: **{100 * ratio:.1f} %**, summed over {pairs} pairs of "
        f"the same mesh and seed that both have a plan. Paper: {PAPER_AREA_PERCENT:.2f} %."
    )


def _variant_table(rows: Sequence[Row], variants: Sequence[str]) -> list[str]:
    pairs = [
        pair
        for pair in combinations(rows)
        if len({row.variant for row in rows if (row.net, row.planner) == pair}) > 1
    ]
    if not pairs:
        return ["Only one variant was run."]
    lines = [
        "| variant | " + " | ".join(label(*pair) for pair in pairs) + " |",
        "|---" * (len(pairs) + 1) + "|",
    ]
    for variant in variants:
        cells = [_percent(case_mean(rows, *pair, variant)[0]) for pair in pairs]
        lines.append(f"| {variant} | " + " | ".join(cells) + " |")
    return lines


def _mesh_table(rows: Sequence[Row], variant: str) -> list[str]:
    pairs = combinations(rows)
    areas = [net for net in ("nb", "ga") if (net, "fp") in pairs]
    head = ["mesh", "faces", "kind", *(label(*pair) for pair in pairs), *(f"area {n.upper()}" for n in areas)]
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    for mesh in sorted({row.mesh for row in rows}):
        group = [row for row in rows if row.mesh == mesh]
        cells = [mesh, str(group[0].faces), group[0].kind]
        for pair in pairs:
            chosen = [row for row in group if (row.net, row.planner, row.variant) == (*pair, variant)]
            cells.append(_percent(mesh_mean(chosen, lambda row: row.completion)))
        for net in areas:
            chosen = [row for row in group if (row.net, row.planner, row.variant) == (net, "fp", variant)]
            area = mesh_mean(chosen, lambda row: row.clipped_area_mm2)
            cells.append("–" if area is None else f"{area:.0f}")
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def _failures(rows: Sequence[Row]) -> list[str]:
    reasons: dict[tuple[str, str, str], list[Row]] = {}
    for row in rows:
        if row.status != "ok":
            reasons.setdefault((row.mesh, row.net, row.status), []).append(row)
    if not reasons:
        return ["None."]
    return [
        f"- {mesh}, {net}: {status} in {len(group)} rows: {group[0].reason[:240]}"
        for (mesh, net, status), group in sorted(reasons.items())
    ]


def _percent(share: float | None) -> str:
    return "–" if share is None else f"{100 * share:.2f}"


def _percent_value(share: float | None) -> float | None:
    return None if share is None else round(100 * share, 4)
