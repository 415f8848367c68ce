"""``blossom calibrate``: fit the heating model of a material to burnt creases."""

from __future__ import annotations

import json as json_text
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from studio.commands_lists import say
from studio.errors import OutputError, UsageError
from studio.exit_codes import DONE
from studio.flags import Json, positive

if TYPE_CHECKING:
    from rigs.material import Material
    from twin.calibration import Fit

__all__ = ["calibrate"]

PICTURE = ".svg"


def calibrate(
    table: Annotated[
        Path, Parameter(metavar="TABLE", help="CSV of burnt creases, such as of blossom testgrid.")
    ],
    /,
    *,
    material: Annotated[
        str,
        Parameter(metavar="NAME|FILE", help="What was burnt: a name (see blossom materials) or a profile."),
    ],
    thickness: Annotated[float, Parameter(metavar="MM", validator=positive, help="Thickness of the sheet.")],
    temper: Annotated[
        str | None, Parameter(metavar="NAME", help="Temper, such as annealed or full-hard [of the profile].")
    ] = None,
    spot: Annotated[
        float | None,
        Parameter(
            metavar="MM", validator=positive, help="1/e² diameter of the beam, where the table does not say."
        ),
    ] = None,
    wavelength: Annotated[
        float, Parameter(metavar="NM", validator=positive, help="Of the laser that burnt the table.")
    ] = 1064.0,
    leave_out: Annotated[
        Literal["setting", "speed", "thickness"],
        Parameter(
            metavar="setting|speed|thickness",
            help="What is left out together to see how well the rest predicts it.",
        ),
    ] = "setting",
    output: Annotated[
        Path | None,
        Parameter(
            metavar="FILE",
            name=["-o", "--output"],
            help="Material file to write [named after the table]; a picture goes beside it.",
        ),
    ] = None,
    force: Annotated[
        bool, Parameter(show_default=False, help="Replace the files that are there already.")
    ] = False,
    json: Json = False,
) -> int:
    """Fit absorptivity, threshold and pass law of a metal to burnt creases, and write a material file.

    Robust least squares; what the table does not determine keeps its default and is named. The file is
    graded by how well groups of rows are predicted that the fit did not see. Take it with --material FILE.
    A table of cut windows (blossom testgrid --kind kerf) tells which settings cut and how wide.

    Examples:
        blossom calibrate strip/strip.csv --material 304 --thickness 0.1 -o my-304.toml

        blossom make bunny.obj --size 60 --material my-304.toml
    """  # fmt: skip
    from planner.atomic_file import write_atomic
    from rigs.material import load_material, parse_material
    from rigs.profile_writer import profile_toml
    from studio.calibration_svg import calibration_svg
    from studio.kerf_words import kerf_lines, kerf_values
    from twin.calibrated_material import calibrated_material
    from twin.calibration import calibrate as fit_table
    from twin.calibration_table import read_table
    from twin.kerf_table import is_kerf_table, read_kerfs

    if is_kerf_table(table):
        kerfs = read_kerfs(table)
        if json:
            say(json_text.dumps(kerf_values(table, kerfs), ensure_ascii=False, allow_nan=False))
        else:
            for line in kerf_lines(kerfs):
                say(line)
        return DONE
    target = output or Path(f"{table.stem}-{Path(material).stem.replace('/', '-')}.toml")
    if target.suffix != ".toml":
        raise UsageError(f"-o {target}: expected a name that ends in .toml")
    picture = target.with_suffix(PICTURE)
    for path in (target, picture):
        if path.exists() and not force:
            raise OutputError(f"{path}: is there already; name another file with -o, or add --force")
    metal = load_material(material)
    if temper is not None:
        metal = metal.with_temper(temper)
    fit = fit_table(read_table(table, spot), metal, thickness, wavelength_nm=wavelength, leave_out=leave_out)
    fitted = calibrated_material(fit, metal)
    text = profile_toml(fitted, f"Written by blossom calibrate from {table.name}.")
    parse_material(text, str(target))
    write_atomic(picture, calibration_svg(fit, _curves(fit, metal)))
    write_atomic(target, text)
    values = _values(fit, fitted, target, picture)
    if json:
        say(json_text.dumps(values, ensure_ascii=False, allow_nan=False))
        return DONE
    _tell(fit, target, picture)
    return DONE


def _curves(fit: Fit, metal: Material) -> list[tuple[str, list[tuple[float, float]]]]:
    """Angle over passes of every setting of the table, by the fit."""
    from dataclasses import replace

    from twin.pass_fit import predict

    first = {row.setting: row for row in reversed(fit.table.rows)}
    most = max(row.passes for row in fit.table.rows)
    counts = sorted({max(1, round(most * k / 30)) for k in range(31)})
    values = {p.name: p.value for p in fit.parameters}
    out = []
    for setting in dict.fromkeys(row.setting for row in fit.table.rows):
        row = first[setting]
        rows = [replace(row, passes=n) for n in counts]
        degrees = predict(metal, rows, fit.thickness_mm, **values).tolist()
        name = f"{row.power_w:g} W, {row.speed_mm_s:g} mm/s"
        if len(fit.thicknesses_mm) > 1:
            name += f", {row.thickness_mm or fit.thickness_mm:g} mm"
        out.append((name, list(zip(map(float, counts), degrees, strict=True))))
    return out


def _values(fit: Fit, fitted: Material, target: Path, picture: Path) -> dict[str, Any]:
    left = fit.left_out
    known = left.groups > 1
    return {
        "format": "metal-blossom/calibration",
        "version": 1,
        "table": fit.table.name,
        "material": fitted.name,
        "temper": fitted.temper_name,
        "thickness_mm": list(fit.thicknesses_mm),
        "wavelength_nm": fit.wavelength_nm,
        "parameters": [
            {"name": p.name, "value": p.value, "sigma_relative": p.sigma, "fitted": p.fitted, "why": p.why}
            for p in fit.parameters
        ],
        "correlation": fit.correlation.tolist(),
        "grade": fit.grade,
        "rms_relative": fit.rms,
        "scatter_crease": fit.scatter_crease,
        "left_out": {
            "by": left.by,
            "groups": left.groups,
            "rms_relative": left.rms if known else None,
            "worst_relative": left.worst if known else None,
        },
        "rows": [
            {
                "line": row.line, "power_w": row.power_w, "speed_mm_s": row.speed_mm_s, "passes": row.passes,
                "angle_deg": row.angle_deg, "fitted_deg": value, "left_out_deg": blind if known else None,
            }
            for row, value, blind in zip(
                fit.table.rows, fit.predicted_deg.tolist(), left.predicted_deg.tolist(), strict=True
            )
        ],
        "notes": list(fit.notes),
        "file": str(target),
        "sha256": fitted.sha256,
        "picture": str(picture),
    }  # fmt: skip


_NAMES = {"absorptivity": "absorptivity", "threshold": "threshold", "half_passes": "half passes"}


def _tell(fit: Fit, target: Path, picture: Path) -> None:
    for p in fit.parameters:
        text = (
            f"{p.value:.4g} ± {100.0 * p.sigma:.1f} %" if p.fitted else f"{p.value:.4g}, not fitted: {p.why}"
        )
        say(f"{_NAMES[p.name]:<14}{text}")
    say(f"{'creases':<14}{len(fit.table.rows)}, {100.0 * fit.rms:.1f} % off by the fit (rms)")
    left = fit.left_out
    if left.groups > 1:
        say(
            f"{'left out':<14}each {left.by} in turn ({left.groups}): {100.0 * left.rms:.1f} % off (rms), at "
            f"most {100.0 * left.worst:.0f} %"
        )
    if fit.scatter_crease is not None:
        say(f"{'repeats':<14}scatter by {100.0 * fit.scatter_crease:.1f} %")
    say(f"{'grade':<14}{fit.grade}")
    for note in fit.notes:
        say(f"note: {note}")
    say(f"{'written':<14}{target} and {picture}; use it with --material {target}")
