"""``blossom bend``: what one laser setting does to a sheet."""

from __future__ import annotations

import json as json_text
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from studio.exit_codes import DONE
from studio.flags import Json, finite, positive

__all__ = ["bend"]


def bend(
    *,
    material: Annotated[
        str,
        Parameter(metavar="NAME|FILE", help="Sheet metal: a name (see blossom materials) or a profile file."),
    ],
    thickness: Annotated[float, Parameter(metavar="MM", validator=positive, help="Thickness of the sheet.")],
    power: Annotated[float, Parameter(metavar="W", validator=positive, help="Laser power.")],
    speed: Annotated[float, Parameter(metavar="MM/S", validator=positive, help="Speed along the crease.")],
    spot: Annotated[float, Parameter(metavar="MM", validator=positive, help="1/e² diameter of the beam.")],
    temper: Annotated[
        str | None, Parameter(metavar="NAME", help="Temper, such as annealed or full-hard [of the profile].")
    ] = None,
    absorptivity: Annotated[
        float | None,
        Parameter(
            metavar="SHARE",
            validator=positive,
            help="Absorbed share of the light [of the profile at 1.06 µm].",
        ),
    ] = None,
    passes: Annotated[int, Parameter(metavar="N", validator=positive, help="Equal passes.")] = 1,
    tilt: Annotated[
        float, Parameter(metavar="DEG", validator=finite, help="Angle between beam and sheet normal.")
    ] = 0.0,
    start_c: Annotated[
        float, Parameter(metavar="C", validator=finite, help="Temperature before each pass, °C.")
    ] = 20.0,
    moment: Annotated[
        float,
        Parameter(
            metavar="N",
            validator=finite,
            help="Moment per length of crease that pulls away from the laser, N mm/mm (section model).",
        ),
    ] = 0.0,
    crease: Annotated[
        float,
        Parameter(metavar="MM", validator=positive, help="Length of the crease, for the flange over time."),
    ] = 10.0,
    model: Annotated[
        Literal["fast", "section"],
        Parameter(metavar="fast|section", help="Closed form, or layered elasto-plastic section."),
    ] = "section",
    json: Json = False,
) -> int:
    """Say by how much a laser setting folds a sheet, and whether it folds it at all.

    An uncalibrated answer is right about the mechanism and to some 30 % about the angle; blossom calibrate
    fits it to a burnt table.

    Examples:
        blossom bend --material 304 --thickness 0.075 --power 10 --speed 200 --spot 0.1

        blossom bend --material 304/full-hard --thickness 0.1 --power 20 --speed 400 --spot 0.12 --passes 9
    """  # fmt: skip
    from rigs.material import load_material
    from twin.one_setting import bend_answer

    metal = load_material(material)
    if temper is not None:
        metal = metal.with_temper(temper)
    share = metal.absorptivity.at_1064nm if absorptivity is None else absorptivity
    answer = bend_answer(
        metal, thickness, power, speed, spot, absorptivity=share, passes=passes, tilt_deg=tilt,
        start_c=start_c, moment_n=moment, along_mm=crease, model=model,
    )  # fmt: skip
    calibrated = metal.calibration.status == "fitted"
    values: dict[str, Any] = {
        "format": "metal-blossom/bend",
        "version": 1,
        "model": answer.model,
        "material": metal.name,
        "temper": metal.temper_name,
        "calibrated": calibrated,
        "setting": {
            "thickness_mm": thickness, "power_w": power, "speed_mm_s": speed, "spot_mm": spot,
            "absorptivity": share, "passes": passes, "tilt_deg": tilt, "start_c": start_c, "moment_n": moment,
            "crease_mm": crease,
        },
        "angle_deg": answer.angle_deg,
        "pass_angles_deg": list(answer.pass_deg),
        "regime": answer.one.regime,
        "fourier": answer.one.fourier,
        "threshold_w": answer.one.threshold_w,
        "peak_top_c": answer.one.peak_top_c,
        "peak_bottom_c": answer.one.peak_bottom_c,
        "valid": answer.valid,
        "flags": list(answer.flags),
        "flange": {"time_s": list(answer.flange_s), "angle_deg": list(answer.flange_deg)},
    }  # fmt: skip
    if json:
        _say(json_text.dumps(values, ensure_ascii=False, allow_nan=False))
        return DONE
    _tell(values, metal.constants.solidus_c)
    return DONE


def _tell(values: dict[str, Any], solidus_c: float) -> None:
    angle, each = values["angle_deg"], values["pass_angles_deg"]
    shown = "not known" if angle is None else f"{angle + 0.0:.3f}°".replace("-0.000", "0.000")
    if len(each) > 1:
        shown += f" after {len(each)} passes, {each[0]:.3f}° the first and {each[-1]:.3f}° the last"
    rows = [
        ("angle", shown),
        ("regime", f"{values['regime']} (Fourier number {values['fourier']:.2g})"),
        ("lit face", f"up to {values['peak_top_c']:.0f} °C, melts at {solidus_c:.0f} °C"),
        ("other face", f"up to {values['peak_bottom_c']:.0f} °C"),
        ("yields from", f"{values['threshold_w']:.2g} W"),
        ("can be used", "yes" if values["valid"] else "no"),
        ("calibrated", "yes" if values["calibrated"] else "no: the angle may be 30 % off"),
    ]
    if values["flange"]["angle_deg"]:
        dip = min(values["flange"]["angle_deg"])
        rows.insert(1, ("counter-bend", f"{min(dip, 0.0):.4f}° of the flange on the way"))
    for name, text in rows:
        _say(f"{name:<14}{text}")
    for flag in values["flags"]:
        _say(f"note: {flag}")


def _say(text: str) -> None:
    print(text)  # noqa: T201  command output
