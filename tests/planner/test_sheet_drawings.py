"""sheet.svg and sheet.dxf, read back with other libraries: real size, layers, same bytes every time."""

from __future__ import annotations

import itertools
import math
import os
import re
import subprocess
import sys
from dataclasses import replace

import ezdxf
import numpy as np
import pytest
import svgelements

from planner.fold_plan import Clip, Cut, Release
from planner.sheet_dxf import sheet_dxf, write_sheet_dxf
from planner.sheet_layers import LAYER_COLOURS, LAYERS, sheet_layers
from planner.sheet_svg import sheet_svg, write_sheet_svg
from tests.planner.hand_plans import plan_for, some_nets

NETS = some_nets()


def length(path):
    return sum(math.dist(a, b) for a, b in itertools.pairwise(path))


@pytest.fixture(scope="module", params=["cross", "wedge", "plate"])
def plan(request):
    whole = plan_for(NETS[request.param])
    free = np.flatnonzero(~whole.sheet.frame_faces)
    hits = np.random.default_rng(2).choice(free, len(free) // 10, replace=False).tolist()
    return plan_for(NETS[request.param], hits)


def wanted(plan):
    return {name: sum(map(length, paths)) for name, paths in sheet_layers(plan).items()}


def test_layers_hold_every_cut_once(plan):
    layers = sheet_layers(plan)
    cut = sum(length(p) for s in plan.steps if isinstance(s, Cut) for p in s.paths)
    release = sum(length(p) for s in plan.steps if isinstance(s, Release) for p in s.paths)
    assert sum(map(length, layers["CUT"])) + sum(map(length, layers["CLIP"])) == pytest.approx(cut)
    assert sum(map(length, layers["TAB"])) == pytest.approx(release)
    assert layers["CLIP"]
    creases = {"V": len(layers["VALLEY"]), "M": len(layers["MOUNTAIN"])}
    assert creases == {k: int((plan.net.assignment == k).sum()) for k in "VM"}


def test_the_clip_layer_is_the_seam_between_clipped_and_kept_metal(plan):
    clipped = {t for s in plan.steps if isinstance(s, Clip) for t in s.faces}
    rows = plan.sheet.faces.tolist()
    owner = {(r[k], r[(k + 1) % 3]): t for t, r in enumerate(rows) for k in range(3)}
    seam = [
        (a, b)
        for (a, b), t in owner.items()
        if t in clipped and (b, a) in owner and owner[b, a] not in clipped
    ]
    reference = sum(math.dist(*plan.sheet.vertices[list(edge)]) for edge in seam)
    assert wanted(plan)["CLIP"] == pytest.approx(reference, abs=0.5 * len(seam) * plan.limits.kerf)


def test_svg_in_mm(plan, tmp_path):
    path = tmp_path / "sheet.svg"
    write_sheet_svg(plan, path)
    drawing = svgelements.SVG.parse(str(path), ppi=25.4, reify=True)
    low, high = plan.sheet.outline.min(axis=0), plan.sheet.outline.max(axis=0)
    assert (drawing.width, drawing.height) == pytest.approx(
        tuple(high - low), rel=1e-6
    )  # its inch is rounded
    found = {
        group.id: sum(p.length(error=1e-7) for p in group.select(lambda e: isinstance(e, svgelements.Path)))
        for group in drawing.select(lambda e: isinstance(e, svgelements.Group) and e.id in LAYERS)
    }
    assert set(found) == set(LAYERS)
    for name, expected in wanted(plan).items():
        assert found[name] == pytest.approx(expected, abs=1e-3), name
    box = drawing.bbox()
    assert box[:2] == pytest.approx((0.0, 0.0), abs=0.1)


def test_svg_points_lie_where_the_plan_has_them(plan):
    text = sheet_svg(plan)
    block = text[text.index('id="CUT"') :]
    first = re.search(r'd="M([-\d.]+),([-\d.]+)', block)
    low, high = plan.sheet.outline.min(axis=0), plan.sheet.outline.max(axis=0)
    point = float(first[1]) + low[0], high[1] - float(first[2])
    assert point == pytest.approx(sheet_layers(plan)["CUT"][0][0], abs=2e-6)


def test_svg_layers_are_layers_of_inkscape_with_colours_of_lightburn(plan):
    text = sheet_svg(plan)
    for name in LAYERS:
        assert re.search(
            rf'<g id="{name}" inkscape:label="{name}" inkscape:groupmode="layer"[^>]*{LAYER_COLOURS[name]}',
            text,
        )


def test_dxf_in_mm(plan, tmp_path):
    path = tmp_path / "sheet.dxf"
    write_sheet_dxf(plan, path)
    document = ezdxf.readfile(path)
    assert document.units == ezdxf.units.MM
    assert not document.audit().errors
    found = dict.fromkeys(LAYERS, 0.0)
    for entity in document.modelspace():
        assert entity.dxftype() == "LWPOLYLINE"
        points = [p[:2] for p in entity.get_points()]
        if entity.dxf.layer in found:
            found[entity.dxf.layer] += length(points + points[:1] if entity.closed else points)
        else:
            assert entity.dxf.layer == "SHEET"
            assert np.array(points) == pytest.approx(plan.sheet.outline)
    for name, expected in wanted(plan).items():
        assert found[name] == pytest.approx(expected, abs=1e-6), name
    for name in LAYERS:
        assert "#{:02X}{:02X}{:02X}".format(*document.layers.get(name).rgb) == LAYER_COLOURS[name]


def test_same_plan_same_bytes_in_this_process(plan):
    assert sheet_dxf(plan) == sheet_dxf(plan)
    assert sheet_svg(plan) == sheet_svg(plan)
    assert ezdxf.options.write_fixed_meta_data_for_testing is False  # the setting was put back


def test_same_plan_same_bytes_in_other_processes(repository):
    """Sets of texts have another order in every process: none may reach the files."""
    script = (
        "import hashlib; from tests.planner.hand_plans import plan_for, some_nets\n"
        "from planner.sheet_dxf import sheet_dxf; from planner.sheet_svg import sheet_svg\n"
        "from planner.plan_file import plan_bytes\n"
        "plan = plan_for(some_nets()['wedge'], range(150, 190))\n"
        "drawings = (sheet_dxf(plan) + sheet_svg(plan)).encode()\n"
        "print(hashlib.sha256(drawings + plan_bytes(plan, {})).hexdigest())"
    )
    results = set()
    for seed in ("0", "1", "12", "123"):
        environment = {**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(repository)}
        done = subprocess.run(
            [sys.executable, "-c", script],
            capture_output=True,
            text=True,
            check=True,
            env=environment,
            cwd=repository,
        )
        results.add(done.stdout)
    assert len(results) == 1


def test_a_plan_with_nothing_to_clip_or_fold_can_be_drawn():
    plan = plan_for(NETS["plate"])
    layers = sheet_layers(plan)
    assert layers["CLIP"] == layers["VALLEY"] == layers["MOUNTAIN"] == ()
    assert sheet_svg(plan).count("<g ") == len(LAYERS) + 1
    assert sheet_dxf(replace(plan, steps=plan.steps[:1]))
