"""How near the tables of the section model are to the model itself, and what they cost.

``python -m benchmarks.section_tables`` prints one row per setting.
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from rigs.material import load_material
from twin.section_model import SectionCase, section_passes
from twin.section_table import TABLE_PASSES, make_table

STARTS_C = (20.0, 37.0, 120.0, 173.0)
SHARES = (0.3, 0.52, 0.62, 0.75, 0.95)


def main() -> None:
    """Print the table."""
    steel = load_material("304")
    cases = [
        SectionCase(steel, 0.075, 10.0, 200.0, 0.12),
        SectionCase(steel, 0.1, 10.0, 200.0, 0.1),
        SectionCase(steel, 0.1, 15.0, 400.0, 0.1),
        SectionCase(steel, 0.05, 5.0, 300.0, 0.1, tilt_rad=0.5),
    ]
    section_passes(cases[:1])  # compiles
    print("| setting | table, s | pass, % | 80 passes, % | weaker, % | 10 500 looked up, ms |")
    print("|---|---|---|---|---|---|")
    for case in cases:
        began = time.process_time()
        table = make_table(case, 200.0)
        cost = time.process_time() - began
        one, chain = 0.0, 0.0
        for start in STARTS_C:
            direct = section_passes([replace(case, start_c=start)], 2 * TABLE_PASSES)[0].angle_rad
            found = table.angles(np.full(len(direct), start))
            one = max(one, float(np.abs(found / direct - 1.0)[:TABLE_PASSES].max()))
            chain = max(chain, abs(float(found.sum() / direct.sum()) - 1.0))
        weaker = max(
            abs(
                table.angle_at_share(share)
                / float(section_passes([replace(case, power_w=share * case.power_w)])[0].angle_rad[0])
                - 1.0
            )
            for share in SHARES
        )
        began = time.process_time()
        table.angles(np.linspace(20.0, 200.0, 10_500))
        seconds = time.process_time() - began
        name = f"{1e3 * case.thickness_mm:.0f} µm, {case.power_w:g} W, {case.speed_mm_s:g} mm/s"
        print(
            f"| {name} | {cost:.2f} | {100 * one:.2f} | {100 * chain:.2f} | {100 * weaker:.2f} "
            f"| {1e3 * seconds:.1f} |"
        )


if __name__ == "__main__":
    main()
