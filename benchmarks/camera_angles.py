"""How well a camera with tags tells fold angles: rendered pictures of a box net over many poses.

``python -m benchmarks.camera_angles --poses 120``
"""

from __future__ import annotations

import argparse
import math
from collections import Counter
from dataclasses import replace

import numpy as np

from planner.net import Net
from rigs.errors import JobError
from rigs.hinge_fit import Lens, fit_hinge
from rigs.tag_layout import Tag, hinge_of, tags_for
from rigs.tag_pictures import find_tags
from tests.rigs.made_jobs import made_plan
from twin.part_pictures import Scene, part_picture, view_of_crease

LENS = Lens(
    np.array([(900.0, 0.0, 320.0), (0.0, 900.0, 240.0), (0.0, 0.0, 1.0)]),
    np.array([-0.1, 0.02, 1e-3, -5e-4, 0.0]),
)
PLACED_MM = 0.05


def misplaced(tags: tuple[Tag, ...], rng: np.random.Generator) -> list[Tag]:
    """The tags as a hand puts them: each off by ``PLACED_MM`` in both directions, and turned as much."""
    out = []
    for tag in tags:
        dx, dy, turn = rng.normal(0.0, PLACED_MM, 3)
        x, y = tag.centre_mm
        spin = math.degrees(turn / tag.size_mm)
        out.append(replace(tag, centre_mm=(x + dx, y + dy), turned_deg=tag.turned_deg + spin))
    return out


def one(net: Net, tags: tuple[Tag, ...], blur: tuple[float, float], seed: int) -> tuple[float, float] | str:
    """Error and standard deviation of one reading, degrees, or why there is none."""
    rng = np.random.default_rng(seed)
    creases = [c for c in net.child_of if net.assignment[c] in ("V", "M")]
    crease = creases[int(rng.integers(len(creases)))]
    angle = rng.uniform(-100.0, 100.0)
    angles = np.zeros(len(net.edges))
    angles[crease] = math.radians(angle)
    view = view_of_crease(
        net, angles, crease, LENS, (640, 480), away_mm=rng.uniform(55.0, 100.0),
        lean=(rng.uniform(-0.5, 0.5), rng.uniform(-0.4, 0.4)), roll_rad=rng.uniform(-3.0, 3.0),
    )  # fmt: skip
    scene = Scene(rays=2, noise=rng.uniform(1.0, 5.0), blur_px=rng.uniform(*blur), seed=seed)
    picture = part_picture(net, angles, misplaced(tags, rng), view, scene)
    try:
        expected = math.radians(angle + rng.normal(0.0, 5.0))
        fit = fit_hinge(find_tags(picture), hinge_of(net, crease, tags), LENS, expected, placed_mm=PLACED_MM)
    except JobError as error:
        return str(error).partition(" (")[0]
    return math.degrees(fit.angle_rad) - angle, math.degrees(fit.sigma_rad)


def main() -> None:
    """Print one row for sharp and one for soft pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--poses", type=int, default=60)
    poses = parser.parse_args().poses
    net = made_plan("box").net
    tags = tags_for(net)
    print("| blur, px | poses | read | median | rms | 95 % | largest | median sigma | within 1, 2 sigma |")
    print("|---|---|---|---|---|---|---|---|---|")
    for blur in ((0.3, 1.0), (1.0, 2.0)):
        results = [one(net, tags, blur, seed) for seed in range(poses)]
        reads = np.array([r for r in results if not isinstance(r, str)])
        error, score = np.abs(reads[:, 0]), np.abs(reads[:, 0] / reads[:, 1])
        print(
            f"| {blur[0]:g} to {blur[1]:g} | {poses} | {len(reads)} | {np.median(error):.2f}° | "
            f"{np.sqrt((error**2).mean()):.2f}° | {np.percentile(error, 95):.2f}° | {error.max():.2f}° | "
            f"{np.median(reads[:, 1]):.2f}° | {(score < 1).mean():.0%}, {(score < 2).mean():.0%} |"
        )
        for words, count in Counter(r for r in results if isinstance(r, str)).items():
            print(f"not read, {count}: {words}")


if __name__ == "__main__":
    main()
