"""Moving-spot temperatures against known limits, a plain integral and published powers."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from rigs.material import load_material
from twin.moving_spot import peak_rise_per_watt, temperature_rise

A, RC = 5.0e-6, 4.7e6
K = A * RC


def plain_rise(x: float, z: float, v: float, h: float, w: float, a: float, rc: float) -> float:
    """The same integral by adaptive quadrature, images only (many of them)."""

    def integrand(log_tau: float) -> float:
        tau = np.exp(log_tau)
        s = w**2 / 4 + 2 * a * tau
        n = np.arange(-160, 161)
        through = np.sum(np.exp(-((z - 2 * n * h) ** 2) / (4 * a * tau))) / np.sqrt(np.pi * a * tau)
        return tau * np.exp(-((v * tau - x) ** 2) / (2 * s)) / (2 * np.pi * s) * through

    marks = np.linspace(np.log(1e-12), np.log(max(60 * h**2 / a, 120 * a / v**2)), 25)
    parts = [quad(integrand, a0, b0, limit=200)[0] for a0, b0 in itertools.pairwise(marks)]
    return sum(parts) / rc


@pytest.mark.parametrize("v", [0.02, 0.1, 0.5, 2.0])
@pytest.mark.parametrize(("place", "depth"), [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (3.0, 1.0), (-0.5, 0.0)])
def test_against_adaptive_quadrature(v, place, depth):
    w, h = 50e-6, 80e-6
    fast = temperature_rise(
        place * w, depth * h, speed=v, thickness=h, along=w, across=w, diffusivity=A, heat_capacity=RC
    )
    peak = temperature_rise(w, 0.0, speed=v, thickness=h, along=w, across=w, diffusivity=A, heat_capacity=RC)
    assert float(fast) == pytest.approx(
        plain_rise(place * w, depth * h, v, h, w, A, RC), abs=0.01 * float(peak)
    )


def test_a_slow_spot_on_a_thick_plate_is_the_stationary_limit():
    """P / (sqrt(2 pi) k w): Gaussian spot on a half-space."""
    w = 50e-6
    rise = temperature_rise(
        0.0, 0.0, speed=1e-4, thickness=1e-2, along=w, across=w, diffusivity=A, heat_capacity=RC
    )
    assert float(rise) == pytest.approx(1.0 / (np.sqrt(2 * np.pi) * K * w), rel=0.01)


def test_far_behind_a_fast_spot_the_plate_is_a_line_source():
    """P / v over rho c h sqrt(4 pi a t) on the line, time t behind the spot."""
    w, h, v, t = 30e-6, 50e-6, 1.0, 5e-3
    rise = temperature_rise(
        v * t, 0.0, speed=v, thickness=h, along=w, across=w, diffusivity=A, heat_capacity=RC
    )
    assert float(rise) == pytest.approx(1.0 / v / (RC * h * np.sqrt(4 * np.pi * A * t)), rel=0.02)


@given(
    st.floats(0.005, 2.0),
    st.floats(40e-6, 250e-6),
    st.floats(15e-6, 200e-6),
    st.sampled_from([2e-6, 5e-6, 7e-5]),
)
@settings(max_examples=25)
def test_the_peak_is_a_maximum_and_the_bottom_colder(v, h, w, a):
    spot = {"speed": v, "thickness": h, "along": w, "across": w, "diffusivity": a, "heat_capacity": RC}
    top, bottom = peak_rise_per_watt(**spot)
    assert float(bottom) <= float(top)
    places = np.linspace(-1.0, 4.0, 60) * w
    found = temperature_rise(places, np.zeros(60), **spot).max()
    assert float(top) == pytest.approx(found, rel=0.02)


@given(st.floats(0.01, 1.0), st.floats(40e-6, 200e-6), st.floats(20e-6, 100e-6))
@settings(max_examples=25)
def test_faster_wider_thicker_is_colder(v, h, w):
    def top(v: float, h: float, w: float) -> float:
        return float(
            peak_rise_per_watt(speed=v, thickness=h, along=w, across=w, diffusivity=A, heat_capacity=RC)[0]
        )

    here = top(v, h, w)
    assert top(1.3 * v, h, w) < here
    assert top(v, h, 1.3 * w) < here
    assert top(v, 1.3 * h, w) < here * 1.002


def test_published_powers_of_first_melting_and_melt_through():
    """304, 75 µm, 100 µm spot, absorptivity 0.35: melting powers of the section model within 15 %."""
    material = load_material("304")
    t = np.arange(20.0, 1425.0)
    k = np.mean([material.value("conductivity_w_mk", x) for x in t])
    rc = 7900.0 * np.mean([material.value("heat_capacity_j_kgk", x) for x in t])
    v = np.array([20, 50, 100, 200, 400, 800]) * 1e-3
    top, bottom = peak_rise_per_watt(
        speed=v, thickness=75e-6, along=50e-6, across=50e-6, diffusivity=k / rc, heat_capacity=rc
    )
    assert 1405 / (0.35 * top) == pytest.approx(np.array([8.0, 9.7, 11.6, 14.1, 17.4, 22.5]), rel=0.15)
    assert 1405 / (0.35 * bottom) == pytest.approx(np.array([16, 24, 35, 56, 100, 189]), rel=0.15)
