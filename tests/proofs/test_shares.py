"""A fixed share of the negative controls, in every run of the tests."""

from __future__ import annotations

import pytest

from proofs.negative_controls import judged
from proofs.nulls import FAMILIES

RECORDS = 15


@pytest.fixture(scope="module")
def alarms() -> list[tuple[str, int, bool, bool]]:
    """Family, seed, whether an oscillation is reported and whether the valve is blamed, of each record with a
    finding."""
    cases = [(family, seed) for family in FAMILIES for seed in range(RECORDS)]
    found = [(family, seed, *judged((family, seed))[1:]) for family, seed in cases]
    return [case for case in found if case[2] or case[3]]


def test_at_most_one_record_without_fault_raises_an_alarm(alarms):
    """At most one of 90 records of noise, drift, ramps, quantized and compressed noise raises an alarm."""
    assert len(alarms) <= 1, alarms


def test_no_record_without_fault_blames_the_valve(alarms):
    """The valve is blamed in none of the 90 records."""
    assert not [case for case in alarms if case[3]]
