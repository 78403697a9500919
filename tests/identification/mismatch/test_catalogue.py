"""The catalogue is complete: every effect acts in the simulator, has a sentence and a picture, and is
distinguished."""

from __future__ import annotations

import numpy as np
import pytest

from identification.estimation.prediction_error import scales
from identification.mismatch.catalogue import CANDIDATES, EFFECTS, RECORDER_FAULTS
from identification.mismatch.effect import Fault
from identification.mismatch.outside import COMPETING_EFFECTS, OUTSIDE
from identification.record import Floats
from identification.simulation.open_loop import ModelInputs, simulate
from identification.simulation.parameters import Param, Slot, Variant, neutral

N = 1500
NAMED_IN_CONTRACT, NEVER_FOUND = 30, 1
"""Number of names in the contract, and number of those that are reported only as alternatives (sensor-lag)."""
FOUND_BY_CHECK = ("clock-offset", "controller-gap", "controller-logic", "controller-settings")
"""Names of the effects that the check of the controller finds."""


def inputs() -> ModelInputs:
    """OP up and down over most of its range, with a neighbour and places for steps."""
    k = np.arange(N)
    op = 50 + 30 * np.sin(k / 40.0) + 8 * np.sign(np.sin(k / 7.0))
    pv = 45.0 * np.sin(k / 40.0 - 0.6)
    return ModelInputs(op, 1.0, 50.0, 50.0, (5.0, 95.0), (300, 700, 1100), np.cos(k / 25.0), pv=pv)


def started(variant: Variant) -> Floats:
    """Parameters of a self-regulating loop with a variant at its first start. Sizes that start at zero are a
    tenth of their limit."""
    c = neutral()
    c[Slot.K], c[Slot.T], c[Slot.L] = 1.2, 20.0, 4.5
    for slot, value in variant.fixed.items():
        c[slot] = value
    for i, p in enumerate(variant.params):
        offset, factor = scales(inputs(), c, p)
        c[p.slot] = offset + factor * (variant.starts[0].get(int(p.slot), 0.0) or 0.1 * (-1) ** i * p.high)
    return c


def with_one_changed(c: Floats, p: Param) -> Floats:
    """The same parameters with one changed by 20 %."""
    out = c.copy()
    out[p.slot] *= 0.8
    return out


@pytest.mark.parametrize(
    "variant", [*CANDIDATES, *COMPETING_EFFECTS], ids=lambda v: f"{v.name} {v.label}".strip()
)
def test_every_parameter_acts(variant: Variant) -> None:
    """Every free parameter of an effect changes the simulated PV. A parameter that no kernel uses is detected."""
    plain = neutral()
    plain[Slot.K], plain[Slot.T], plain[Slot.L] = 1.2, 20.0, 4.5
    c = started(variant)
    here = simulate(inputs(), c)
    assert np.abs(here - simulate(inputs(), plain)).max() > 1e-3
    for p in variant.params:
        assert np.abs(here - simulate(inputs(), with_one_changed(c, p))).max() > 1e-6, p.name


def test_every_effect_is_either_fitted_or_found() -> None:
    """An effect is either fitted by its variants, or found in the trends or by the check of the controller;
    never both."""
    for effect in EFFECTS.values():
        found = effect in RECORDER_FAULTS or effect.name in FOUND_BY_CHECK
        assert bool(effect.variants) + found == 1, effect.name
        assert isinstance(effect, Fault) == found, effect.name


def test_every_effect_has_a_sentence_and_a_picture() -> None:
    """Each effect has a sentence, a check for the user, and a picture."""
    for effect in EFFECTS.values():
        assert effect.sentence
        assert effect.check
        drawn = effect.drawn if isinstance(effect, Fault) else effect.curve
        assert drawn is not None, effect.name


def test_names_outside_the_catalogue_are_no_verdicts() -> None:
    """Physics outside the catalogue has no name that could be a verdict."""
    assert not set(OUTSIDE) & set(EFFECTS)


def test_names_are_those_of_the_contract() -> None:
    """The catalogue has as many effects as the contract, and no name has two files."""
    assert len(EFFECTS) == NAMED_IN_CONTRACT - NEVER_FOUND
