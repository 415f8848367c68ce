"""``sheet.dxf``: the sheet in real size for CAM programs, cuts and creases on layers."""

from __future__ import annotations

import io
import os

from planner.atomic_file import write_atomic
from planner.fold_plan import FoldPlan
from planner.sheet_layers import LAYER_COLOURS, LAYERS, sheet_layers

__all__ = ["sheet_dxf", "write_sheet_dxf"]


def write_sheet_dxf(plan: FoldPlan, path: str | os.PathLike[str]) -> None:
    """Write the drawing of the sheet to ``path``, whole or not at all.

    Raises:
        OSError: if the file cannot be written.
    """
    write_atomic(path, sheet_dxf(plan))


def sheet_dxf(plan: FoldPlan) -> str:
    """The sheet as DXF R2010 in mm: the layers of ``LAYERS``, SHEET for the outline. Same plan, same text."""
    import ezdxf
    from ezdxf import units

    # ezdxf stamps files with the clock and random numbers unless this is set; it is put back at once.
    before = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True
    try:
        document = ezdxf.new("R2010", units=units.MM)
        document.header["$MEASUREMENT"] = 1
        drawing = document.modelspace()
        document.layers.add("SHEET", color=8)
        drawing.add_lwpolyline(plan.sheet.outline.tolist(), close=True, dxfattribs={"layer": "SHEET"})
        layers = sheet_layers(plan)
        for name in LAYERS:
            layer = document.layers.add(name)
            layer.rgb = _rgb(LAYER_COLOURS[name])
            for path in layers[name]:
                closed = len(path) > 2 and path[0] == path[-1]
                drawing.add_lwpolyline(
                    path[:-1] if closed else path, close=closed, dxfattribs={"layer": name}
                )
        for kind in sorted(
            document.entitydb.dxf_types_in_use()
        ):  # ezdxf would add them in the order of a set
            document.classes.add_class(kind)
        stream = io.StringIO()
        document.write(stream)
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before
    return stream.getvalue()


def _rgb(colour: str) -> tuple[int, int, int]:
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue
