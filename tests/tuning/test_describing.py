"""Describing functions against the simulated valve model, python-control and their limits."""

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identification.models import Backlash, Motion, Stiction
from identification.simulation.valve import stem_position
from tuning.describing import (
    backlash,
    branches,
    describe,
    jump_range,
    jumps_at,
    moves_by_jumps,
    sliding,
    stick_slip,
)

WIDTHS = st.floats(0.05, 10.0)
SAMPLES = 20_000


def numeric(valve: Backlash | Stiction, amplitude: float) -> complex:
    """N(A) as the fundamental of the last of three periods of the simulated valve model."""
    phase = 2.0 * np.pi * np.arange(3 * SAMPLES) / SAMPLES
    start = -0.5 * jumps_at(amplitude, valve) * valve.slip_jump if moves_by_jumps(valve) else None
    stem = stem_position(-amplitude * np.cos(phase), valve, start)[-SAMPLES:]
    return complex(-2.0 / (SAMPLES * amplitude) * np.sum(stem * np.exp(-1j * phase[-SAMPLES:])))


@given(WIDTHS, st.floats(1.001, 500.0))
def test_backlash_agrees_with_python_control(width, factor):
    """The closed form of backlash agrees with python-control to twelve digits."""
    amplitude = 0.5 * width * factor
    other = control.friction_backlash_nonlinearity(width).describing_function(amplitude)
    assert complex(backlash(amplitude, width)) == pytest.approx(other, abs=1e-12)


@pytest.mark.parametrize("factor", [1.05, 1.35, 2.0, 5.0, 40.0])
def test_backlash_agrees_with_projection(factor):
    """The closed form of backlash is the fundamental of the simulated valve model."""
    valve = Backlash(1.3)
    assert numeric(valve, 0.65 * factor) == pytest.approx(describe(valve, 0.65 * factor), abs=2e-3)


@pytest.mark.parametrize("jump", [0.2, 0.5, 0.8, 1.0])
@pytest.mark.parametrize("amplitude", [0.617, 0.913, 1.237, 1.873, 3.319])
def test_stick_slip_agrees_with_projection(jump, amplitude):
    """The sum of relays is the fundamental of the simulated valve model, with one jump or many jumps per half
    period."""
    valve = Stiction(1.0, jump)
    assert numeric(valve, amplitude) == pytest.approx(describe(valve, amplitude), abs=2e-3)


@pytest.mark.parametrize("jump", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("amplitude", [0.53, 0.617, 0.913, 1.873, 13.19])
def test_sliding_stick_slip_agrees_with_projection(jump, amplitude):
    """The closed form of a stem that slides after its jump is the fundamental of the simulated valve model."""
    valve = Stiction(1.0, jump, motion=Motion.SLIDES)
    assert numeric(valve, amplitude) == pytest.approx(describe(valve, amplitude), abs=2e-3)


@given(WIDTHS, st.floats(1.001, 500.0))
def test_sliding_without_jump_is_backlash(width, factor):
    """The sliding form with J = 0 is Eq. (1) of backlash."""
    a = 0.5 * width * factor
    assert complex(sliding(a, width, 0.0)) == pytest.approx(complex(backlash(a, width)), abs=1e-9)


@given(st.floats(0.1, 3.0), st.floats(1.001, 2.999))
def test_study_stick_slip(d, factor):
    """S = J = 2d with one jump is Eq. (2) of the study for d < A < 3d."""
    a = d * factor
    study = 2 * d / (np.pi * a**2) * np.sqrt(4 * a**2 - 4 * d**2) - 4j * d**2 / (np.pi * a**2)
    assert describe(Stiction(2 * d, 2 * d), a) == pytest.approx(study, abs=1e-12)


@given(st.floats(0.1, 3.0), st.floats(0.05, 1.0), st.integers(1, 12))
def test_fewest_jumps_lie_in_their_range(stickband, share, jumps):
    """At the upper end of a branch, the number of jumps is that of the branch."""
    valve = Stiction(stickband, stickband * share)
    low, high = jump_range(valve, jumps)
    assert low < high
    assert jumps_at(high * (1 - 1e-9), valve) == jumps


@given(WIDTHS)
def test_large_amplitude_has_the_response_of_an_ideal_valve(width):
    """N tends to 1 for amplitudes much larger than the backlash or the stickband."""
    assert abs(describe(Backlash(width), 1e5 * width) - 1) < 1e-4
    assert abs(describe(Stiction(width, 0.5 * width), 2000 * width) - 1) < 2e-3


@given(WIDTHS)
def test_resting_stem_has_no_response(width):
    """Below half the band the stem rests and N is 0. Just above it, N has a phase lag of nearly 90 degrees."""
    assert abs(describe(Backlash(width), 0.5 * width)) < 1e-12
    assert describe(Stiction(width, width), 0.49 * width) == 0
    assert np.angle(describe(Backlash(width), 0.5001 * width), deg=True) < -85


@given(WIDTHS, st.floats(1.01, 30.0))
def test_small_jumps_become_backlash(width, factor):
    """Stick-slip with very small jumps tends to backlash of the same band."""
    amplitude = 0.5 * width * factor + 0.1 * width
    many = max(jumps_at(amplitude, Stiction(width, width / 500)), 1)
    n = stick_slip(amplitude, width, width / 500, many)
    assert complex(n) == pytest.approx(complex(backlash(amplitude, width)), abs=5e-3)


@pytest.mark.parametrize(
    "valve", [Backlash(1.0), Stiction(1.0, 1.0), Stiction(2.0, 0.4), Stiction(1.0, 0.5, Motion.SLIDES)]
)
def test_branches_rise_in_phase_and_agree_with_the_closed_form(valve):
    """On each branch the phase rises with the amplitude, and the table returns the closed form."""
    for branch in branches(valve):
        assert np.all(np.diff(branch.root) < 0)
        inner = -(np.linspace(branch.root[1], branch.root[-2], 37) ** 2)
        log_a, log_n = branch.at_phase(inner)
        a = np.exp(log_a)
        if isinstance(valve, Backlash):
            exact = backlash(a, valve.width)
        elif valve.motion is Motion.SLIDES:
            exact = sliding(a, valve.stickband, valve.slip_jump)
        else:
            exact = stick_slip(a, valve.stickband, valve.slip_jump, branch.jumps)
        assert np.abs(exact) * np.exp(1j * inner) == pytest.approx(exact, abs=1e-5)
        assert np.exp(log_n) == pytest.approx(np.abs(exact), rel=1e-5)
