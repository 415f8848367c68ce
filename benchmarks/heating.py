"""Heating models against 3-D finite elements, convergence and cost: ``python -m benchmarks.heating``."""

from __future__ import annotations

import math
import time

import numpy as np

from rigs.material import load_material
from twin.heating import bend
from twin.section_grid import Resolution
from twin.section_model import SectionCase, section_bend, section_passes

ANCHORS = (("A", 10.0, 100.0, 0.912), ("C", 5.0, 50.0, 0.632))
"""CalculiX, 304 annealed, 75 µm, beam radius 60 µm, absorptivity 0.35: power, speed, degrees."""

SETTINGS = (
    (10, 100, 0.075, 0.12), (5, 50, 0.075, 0.12), (10, 200, 0.075, 0.1), (10, 800, 0.075, 0.1),
    (20, 400, 0.1, 0.12), (8, 100, 0.05, 0.1), (20, 50, 0.15, 0.2),
)  # fmt: skip


def main() -> None:
    """Print the tables."""
    steel = load_material("304")
    section_bend(steel, 0.075, 10, 200, 0.1, absorptivity=0.35)  # compile
    print("| row | FEM, deg | section | ratio | fast | ratio |\n|---|---|---|---|---|---|")
    for name, power, speed, fem in ANCHORS:
        slow = math.degrees(section_bend(steel, 0.075, power, speed, 0.12, absorptivity=0.35).angle_rad[0])
        fast = math.degrees(bend(steel, 0.075, power, speed, spot_mm=0.12, absorptivity=0.35).angle_rad)
        print(f"| {name} | {fem} | {slow:.3f} | {slow / fem:.2f} | {fast:.3f} | {fast / fem:.2f} |")
    print(
        "\n| W | mm/s | mm | spot | section, deg | against 2.5 times as fine | fast / section |\n|"
        + "---|" * 7
    )
    for power, speed, thickness, spot in SETTINGS:
        usual, fine = (
            math.degrees(
                section_bend(
                    steel, thickness, power, speed, spot, absorptivity=0.35, resolution=resolution
                ).angle_rad[0]
            )
            for resolution in (Resolution(), Resolution().finer(2.5))
        )
        fast = math.degrees(bend(steel, thickness, power, speed, spot_mm=spot, absorptivity=0.35).angle_rad)
        print(
            f"| {power} | {speed} | {thickness} | {spot} | {usual:.3f} | {100 * (usual / fine - 1):+.1f} % | "
            f"{fast / usual:.2f} |"
        )
    cases = [SectionCase(steel, 0.075, p, 200.0, 0.1, 0.35) for p in np.linspace(4.0, 13.0, 64)]
    began = time.process_time()
    section_passes(cases)
    each = (time.process_time() - began) / len(cases)
    began = time.process_time()
    section_bend(steel, 0.075, 10, 200, 0.1, absorptivity=0.35, passes=40)
    chain = time.process_time() - began
    print(f"\none pass {1e3 * each:.1f} ms CPU; a chain of 40 passes {chain:.2f} s CPU")


if __name__ == "__main__":
    main()
