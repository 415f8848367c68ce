"""Hidden share of a crease, against polygons, and its laws."""

import math

import numpy as np
import pytest
from numba import njit

from planner._kernels.beam_kernels import BEAM_SIZE, aim, lean
from planner._kernels.cover_kernels import END_SHARE, covered_interval, union_share
from planner._kernels.sight_kernels import (
    FINE_SUBSTEPS,
    REFINED_RAD,
    SIGHT_STEP_RAD,
    SIGHT_SUBSTEPS,
    hidden_share,
    sight_limit,
)
from planner.beam import to_light
from planner.fold_plan import MachineLimits
from tests.planner.contact_reference import hidden_share_reference


@njit  # kernels that only kernels call cannot be called from Python
def share_of(intervals, count):
    return union_share(intervals, count)


@njit
def covered(tri, ax, ay, bx, by, beam):
    return covered_interval(tri, ax, ay, bx, by, beam, False)


@njit
def aimed(angle, ex, ey, head, beam):
    aim(angle, ex, ey, head, beam)


@njit
def leaning(beam, mx, my, ux, uy, sign):
    return lean(beam, mx, my, ux, uy, sign)


def beam_at(rotary, radius=0.0, axis=(1.0, 0.0), spread=0.0, source=None):
    beam = np.zeros(BEAM_SIZE)
    place = (0.0, 0.0, 0.0) if source is None else source
    head = np.array([float(source is not None), *place, 0.3, -0.2, radius, spread])
    aimed(rotary, *axis, head, beam)
    return beam


def cover(triangle, start, end, rotary, radius=0.0, axis=(1.0, 0.0), spread=0.0, source=None):
    lo, hi = covered(triangle, *start, *end, beam_at(rotary, radius, axis, spread, source))
    return (lo, hi) if lo < hi else None


@pytest.mark.parametrize("rotary", [0.0, 0.4, -0.6, math.pi, math.pi + 0.5])
def test_covered_length_equals_the_polygon_intersection(rotary):
    rng = np.random.default_rng(int(1000 * rotary) % 97)
    beam = np.array([0.0, math.sin(rotary), math.cos(rotary)])
    seen = 0
    for _ in range(300):
        start, end = rng.uniform(-2, 2, 2), rng.uniform(-2, 2, 2)
        triangle = rng.uniform(-2, 2, (3, 3))
        triangle[:, 2] = np.sign(math.cos(rotary)) * rng.uniform(0.1, 2, 3)
        found = cover(triangle, start, end, rotary)
        expected = hidden_share_reference(np.append(start, 0.0), np.append(end, 0.0), [triangle], beam)
        assert (found[1] - found[0] if found else 0.0) == pytest.approx(expected, abs=1e-6)
        seen += expected > 0
    assert seen > 20


def test_what_lies_under_the_crease_hides_nothing():
    triangle = np.array([[-1.0, -1.0, -0.5], [1.0, -1.0, -0.5], [0.0, 2.0, -0.5]])
    assert cover(triangle, (-1.0, 0.0), (1.0, 0.0), 0.0) is None
    assert cover(triangle, (-1.0, 0.0), (1.0, 0.0), math.pi) is not None


def test_slanted_triangle_hides_only_where_it_is_above():
    # the plane z = s along the segment: only the half with s > 0 (plus the least height) hides
    triangle = np.array([[-2.0, -3.0, -2.0], [2.0, -3.0, 2.0], [0.0, 3.0, 0.0]])
    lo, hi = cover(triangle, (-1.0, 0.0), (1.0, 0.0), 0.0)
    assert lo == pytest.approx(0.5 + 0.01 / 2.0, abs=1e-9)
    assert hi == pytest.approx(1.0, abs=1e-9)


def test_wider_beam_never_sees_more():
    rng = np.random.default_rng(3)
    for _ in range(300):
        start, end = rng.uniform(-2, 2, 2), rng.uniform(-2, 2, 2)
        triangle = rng.uniform(-2, 2, (3, 3))
        triangle[:, 2] = rng.uniform(0.1, 2, 3)
        thin, wide = (cover(triangle, start, end, 0.3, radius) for radius in (0.0, 0.1))
        if thin is not None:
            assert wide is not None
            assert wide[0] <= thin[0] + 1e-9
            assert wide[1] >= thin[1] - 1e-9


def test_rotating_everything_about_z_changes_nothing():
    rng = np.random.default_rng(5)
    for _ in range(200):
        turn = rng.uniform(0, 2 * math.pi)
        R = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
        start, end = rng.uniform(-2, 2, 2), rng.uniform(-2, 2, 2)
        triangle = rng.uniform(-2, 2, (3, 3))
        turned = triangle.copy()
        turned[:, :2] = triangle[:, :2] @ R.T
        one = cover(triangle, start, end, 0.5)
        other = cover(turned, R @ start, R @ end, 0.5, axis=R @ [1.0, 0.0])
        assert (one is None) == (other is None)
        if one:
            assert one == pytest.approx(other, abs=1e-7)


def test_union_counts_overlapping_intervals_once_and_leaves_out_the_ends():
    intervals = np.array([[0.0, 0.01], [0.3, 0.5], [0.4, 0.6], [0.45, 0.47]])
    assert share_of(intervals, 4) == pytest.approx(0.3 / (1 - 2 * END_SHARE))


@pytest.mark.parametrize("rotary", [0.0, 0.3, math.pi - 0.2])
def test_rays_from_a_point_are_hidden_where_they_pass_the_triangle(rotary):
    rng = np.random.default_rng(11)
    source, axis = (1.0, -2.0, 9.0), np.array([math.cos(0.4), math.sin(0.4)])
    limits = MachineLimits(beam_source=source)
    ray = to_light(rotary, np.zeros(3), limits, axis, (0.3, -0.2))
    side = np.sign(ray[2])
    seen = 0
    for _ in range(200):
        start, end = rng.uniform(-2, 2, 2), rng.uniform(-2, 2, 2)
        triangle = rng.uniform(-2, 2, (3, 3))
        triangle[:, 2] = side * rng.uniform(0.1, 2, 3)
        found = cover(triangle, start, end, rotary, axis=axis, source=source) or (0.0, 0.0)
        normal = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
        for share in np.linspace(0.0, 1.0, 23):
            point = np.append(start + share * (end - start), 0.0)
            ray = to_light(rotary, point, limits, axis, (0.3, -0.2))
            at = point + ray * (normal @ (triangle[0] - point)) / (normal @ ray)
            sides = [np.cross(triangle[k - 2] - triangle[k], at - triangle[k]) @ normal for k in range(3)]
            if min(abs(x) for x in sides) < 1e-3 or min(abs(share - x) for x in found) < 1e-6:
                continue
            assert (min(sides) > 0) == (found[0] < share < found[1])
            seen += min(sides) > 0
    assert seen > 50


def test_far_point_gives_parallel_light():
    triangle = np.array([[-1.0, -1.0, 1.0], [1.0, -1.2, 1.5], [0.0, 1.0, 0.7]])
    far = 1e7
    for rotary in (0.0, 0.5, math.pi + 0.3):
        parallel = cover(triangle, (-1.0, 0.1), (1.0, -0.2), rotary, 0.05)
        source = (0.0, 0.0, far)
        point = cover(triangle, (-1.0, 0.1), (1.0, -0.2), rotary, 0.05, source=source)
        assert (parallel is None) == (point is None)
        if parallel is not None:
            assert point == pytest.approx(parallel, abs=1e-5)


def test_spreading_beam_is_as_wide_as_it_is_at_the_highest_corner():
    triangle = np.array([[-1.0, 0.1, 2.0], [1.0, 0.1, 2.0], [0.0, 3.0, 2.0]])
    assert cover(triangle, (-1.0, 0.0), (1.0, 0.0), 0.0, 0.05) is None
    assert cover(triangle, (-1.0, 0.0), (1.0, 0.0), 0.0, 0.05, spread=0.02) is None
    assert cover(triangle, (-1.0, 0.0), (1.0, 0.0), 0.0, 0.05, spread=0.03) is not None


def test_face_may_lean_until_it_stands_along_the_beam():
    for source in (None, (0.5, 2.0, 30.0)):
        limits = MachineLimits(beam_source=source)
        for rotary in (0.0, 0.6, math.pi - 0.5):
            axis = np.array([math.cos(1.1), math.sin(1.1)])
            middle, way = np.array([0.7, -0.4]), np.array([math.cos(0.2), math.sin(0.2)])
            sign = 1.0 if math.cos(rotary) > 0 else -1.0
            angle = leaning(beam_at(rotary, axis=axis, source=source), *middle, *way, sign)
            light = to_light(rotary, np.append(middle, 0.0), limits, axis, (0.3, -0.2))
            # the flat child's inward normal, turned by the angle, lies in the plane of crease and beam
            across = np.array([-way[1], way[0], 0.0])
            turned = math.cos(angle) * across + math.sin(angle) * sign * np.array([0.0, 0.0, 1.0])
            along = np.append(way, 0.0)
            flat_light = light - (light @ along) * along
            assert turned @ flat_light == pytest.approx(np.linalg.norm(flat_light), abs=1e-9)


@njit
def limit_of(
    panel, moving, flat, solids, centres, radii, crease, sign, limit, beam, hidden_max, substeps, refine
):
    intervals, turned = np.empty((len(solids), 2)), np.empty((3, 3))
    suspects = np.arange(len(solids))
    return sight_limit(
        0, 1, panel, moving, flat, solids, centres, radii, suspects,
        crease[0], crease[1], crease[2], crease[3], crease[4], sign, limit, beam, hidden_max,
        intervals, turned, substeps, refine,
    )  # fmt: skip


@njit
def share_at(panel, moving, flat, solids, centres, radii, crease, sign, angle, beam):
    intervals, turned = np.empty((len(solids), 2)), np.empty((3, 3))
    suspects = np.arange(len(solids))
    return hidden_share(
        0, 1, panel, moving, flat, solids, centres, radii, suspects,
        crease[0], crease[1], crease[2], crease[3], crease[4], sign, angle, beam, intervals, turned,
    )  # fmt: skip


@njit
def plain_share(panel, moving, flat, solids, crease, sign, angle, beam):
    """Every triangle is turned and tested, near or far."""
    ox, oy, ux, uy, length = crease
    intervals, tri = np.empty((len(solids), 2)), np.empty((3, 3))
    c, s = math.cos(angle), math.sin(angle) * sign
    count, worst, who = 0, 0.0, -1
    for g in range(len(solids)):
        if panel[g] == 0 or panel[g] == 1 or (flat[g] and not moving[g]):
            continue
        tri[:] = solids[g, 9:12]
        if moving[g]:
            for k in range(3):
                dx, dy, dz = solids[g, 9 + k, 0] - ox, solids[g, 9 + k, 1] - oy, solids[g, 9 + k, 2]
                a, w = dx * ux + dy * uy, dy * ux - dx * uy
                w2 = w * c - dz * s
                tri[k, 0], tri[k, 1], tri[k, 2] = ox + a * ux - w2 * uy, oy + a * uy + w2 * ux, w * s + dz * c
        thin = moving[g] and angle > 0.0
        lo, hi = covered_interval(tri, ox, oy, ox + ux * length, oy + uy * length, beam, thin)
        if lo < hi:
            intervals[count, 0], intervals[count, 1] = lo, hi
            count += 1
            if hi - lo > worst:
                worst, who = hi - lo, g
    if count == 0:
        return 0.0, -1, 0.0
    return union_share(intervals, count), who, worst


def plain_limit(panel, moving, flat, solids, crease, sign, limit, beam, hidden_max, substeps, refine):
    """The samples of ``sight_limit``, one after the other."""
    count = substeps * max(1, math.ceil(limit / SIGHT_STEP_RAD - 1e-9))
    looks = [
        plain_share(panel, moving, flat, solids, crease, sign, limit * k / count, beam)
        for k in range(count + 1)
    ]
    hidden = [k for k in range(count + 1) if looks[k][0] > hidden_max]
    coarse = [k for k in hidden if k % substeps == 0]
    if not hidden:
        return limit, -1
    # a fine sample beyond the first coarse failure is never looked at
    first = min(k for k in hidden if not coarse or k <= coarse[0])
    by = looks[first][1]
    if first == 0:
        return -1.0, by
    low, high = limit * (first - 1) / count, limit * first / count
    while refine and high - low > REFINED_RAD:
        middle = 0.5 * (low + high)
        share, who, _ = plain_share(panel, moving, flat, solids, crease, sign, middle, beam)
        if share > hidden_max:
            high, by = middle, who
        else:
            low = middle
    return low, by


def scene(rng, far):
    """Triangles over and around a crease, some flat, some standing, some that turn with it."""
    count = 40
    crease = np.array([*rng.uniform(-5, 5, 2), 0.0, 0.0, rng.uniform(1, 6)])
    way = rng.uniform(0, 2 * math.pi)
    crease[2:4] = math.cos(way), math.sin(way)
    solids = rng.uniform(-3, 3, (count, 1, 3)) + rng.normal(0, 1, (count, 12, 3))
    solids[:, :, :2] += crease[:2] + rng.uniform(-1, 1, (count, 1, 2)) * far
    solids[:, :, 2] += rng.uniform(-1, 1, (count, 1)) * far
    flat = rng.random(count) < 0.3
    solids[flat, :, 2] = 0.0
    centres = solids.mean(axis=1)
    radii = np.linalg.norm(solids - centres[:, None], axis=2).max(axis=1)
    panel = rng.integers(0, 30, count)
    return panel, rng.random(count) < 0.5, flat, solids, centres, radii, crease


@pytest.mark.parametrize(
    "source", [None, (1.0, -2.0, 160.0), (3.0, 2.0, 14.0)], ids=["parallel", "from far", "from near"]
)
def test_what_is_left_out_hides_nothing(source):
    rng = np.random.default_rng(7)
    partly = 0
    for trial in range(600):
        side = 1.0 if trial % 2 else -1.0
        rotary = rng.uniform(-0.8, 0.8) + (0.0 if side > 0 else math.pi)
        way = rng.uniform(0, 2 * math.pi)
        beam = beam_at(
            rotary, float(rng.choice([0.0, 0.05, 0.5])), (math.cos(way), math.sin(way)),
            float(rng.choice([0.0, 0.02])), source,
        )  # fmt: skip
        panel, moving, flat, solids, centres, radii, crease = scene(rng, float(rng.choice([2.0, 8.0, 30.0])))
        limit = float(rng.uniform(0.01, 3.1))
        sign = float(rng.choice([-1.0, 1.0]))
        for angle in (0.0, 0.5 * limit, limit):
            found = share_at(panel, moving, flat, solids, centres, radii, crease, sign, angle, beam)
            assert found == plain_share(panel, moving, flat, solids, crease, sign, angle, beam)
        for refine in (False, True):
            hidden_max = float(rng.choice([0.05, 0.3, 0.7]))
            substeps = int(rng.choice([SIGHT_SUBSTEPS, FINE_SUBSTEPS]))
            found = limit_of(
                panel, moving, flat, solids, centres, radii, crease, sign, limit, beam, hidden_max, substeps,
                refine,
            )  # fmt: skip
            assert found == plain_limit(
                panel, moving, flat, solids, crease, sign, limit, beam, hidden_max, substeps, refine
            )
            partly += 0.0 < found[0] < limit
    assert partly > 100


def test_what_passes_over_a_crease_between_two_coarse_samples_is_seen_by_the_fine_ones():
    """A thin blade 5 mm over the crease, that hides it while it turns from 20.3 to 21 degrees, no longer."""
    crease = np.array([0.0, 0.0, 1.0, 0.0, 4.0])
    blade = np.array([[-1.0, 0.0], [5.0, 0.0], [2.0, math.radians(0.7)]])
    from_upright = math.radians(20.3) + blade[:, 1]
    corners = np.column_stack([blade[:, 0], 5.0 * np.sin(from_upright), 5.0 * np.cos(from_upright)])
    solids = np.zeros((1, 12, 3))
    solids[0] = corners.mean(axis=0)
    solids[0, 9:12] = corners
    centres, radii = corners.mean(axis=0)[None], np.array([5.0])
    panel, moving, flat = np.array([5]), np.array([True]), np.array([False])

    def seen(substeps):
        return limit_of(
            panel, moving, flat, solids, centres, radii, crease, 1.0, math.radians(60.0), beam_at(0.0), 0.05,
            substeps, True,
        )  # fmt: skip

    assert seen(SIGHT_SUBSTEPS) == (math.radians(60.0), -1)
    angle, by = seen(FINE_SUBSTEPS)
    assert by == 0
    assert math.radians(20.3 - 0.1) <= angle <= math.radians(21.0)
