"""The section model against 3-D finite elements: ``python -m benchmarks.calculix [NAME...]``.

Needs CalculiX (Debian package ``calculix-ccx``); without it nothing is run and that is said. Each pass is
one transient heat run and one elasto-plastic run, both with the product's own material profiles, a few
minutes of one core together. The constant of the section model was fitted to none of these settings.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from pathlib import Path

from benchmarks.calculix_deck import Pass
from benchmarks.calculix_run import CalculixError, available, bent
from rigs.material import load_material
from twin.section_model import HARDENING_MPA, section_bend

CASES = (
    Pass("1", "304", 20.0, 400.0, 0.06, 0.075),
    Pass("2", "304", 7.0, 70.0, 0.06, 0.075),
    Pass("3", "304", 15.0, 150.0, 0.06, 0.1),
    Pass("4", "304", 20.0, 100.0, 0.08, 0.15),
    Pass("5", "304", 5.0, 50.0, 0.06, 0.1),
    Pass("6", "316", 18.0, 300.0, 0.06, 0.1),
)

WITHIN = 0.15


def main() -> int:
    """Print one row per pass; 1 if a ratio is off by more than ``WITHIN``."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help=f"passes, of {', '.join(c.name for c in CASES)} [all]")
    parser.add_argument("--keep", type=Path, help="folder for decks and results [a temporary one]")
    parser.add_argument("--finer", type=float, default=1.0, help="so many times as many elements per axis")
    options = parser.parse_args()
    unknown = sorted(set(options.names) - {c.name for c in CASES})
    if unknown:
        parser.error(f"no pass is named {', '.join(unknown)}")
    if not available():
        print("CalculiX (ccx) is not installed: nothing was run. Debian: apt-get install calculix-ccx")
        return 0
    print(
        "| pass | metal, µm | W, mm/s, radius µm | Fo, regime | finite elements, ° (entrance to exit) "
        "| section, ° | section / FEM | fast / FEM | peaks FEM, °C | peaks model, °C | CPU s |\n|"
        + "---|"
        * 11
    )
    missed = 0
    with tempfile.TemporaryDirectory() as scratch:
        for case in CASES:
            if options.names and case.name not in options.names:
                continue
            folder = (options.keep or Path(scratch)) / case.name
            try:
                missed += _row(case, folder, options.finer)
            except CalculixError as error:
                missed += 1
                print(f"| {case.name} | {error} |", flush=True)
    return 1 if missed else 0


def _row(case: Pass, folder: Path, finer: float) -> bool:
    """Print a pass; True if the section model misses."""
    metal = load_material(case.material)
    model = section_bend(
        metal, case.thickness_mm, case.power_w, case.speed_mm_s, 2.0 * case.radius_mm,
        absorptivity=case.absorptivity,
    )  # fmt: skip
    angle, fast = math.degrees(float(model.angle_rad[0])), math.degrees(model.fast.angle_rad)
    found = bent(case, metal, folder, HARDENING_MPA, finer)
    ratio = angle / found.angle_deg
    print(
        f"| {case.name} | {case.material}, {1e3 * case.thickness_mm:.0f} | {case.power_w:g}, "
        f"{case.speed_mm_s:g}, {1e3 * case.radius_mm:.0f} | {model.fast.fourier:.2f}, {model.fast.regime} "
        f"| {found.angle_deg:.3f} ({found.entrance_deg:.3f} to {found.exit_deg:.3f}) | {angle:.3f} "
        f"| {ratio:.2f} | {fast / found.angle_deg:.2f} | {found.peak_top_c:.0f}, {found.peak_bottom_c:.0f} "
        f"| {model.peak_top_c:.0f}, {model.peak_bottom_c:.0f} | {found.seconds:.0f} |",
        flush=True,
    )
    return abs(ratio - 1.0) > WITHIN


if __name__ == "__main__":
    sys.exit(main())
