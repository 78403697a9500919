"""The position of a valve and the mode of a controller are named if the data show one; otherwise none is named."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from analyzer.finder.clock import Sampled
from analyzer.finder.draft import by_data
from analyzer.finder.position_and_mode import may_be_mode, modes, positions
from tests.analyzer.finder.test_finder_pairs import pi_loop, unrelated_tags


def stem_with_backlash(op: np.ndarray, width: float) -> np.ndarray:
    """Positions of a stem with backlash, shape (n,)."""
    stem = op.copy()
    for k in range(1, len(op)):
        stem[k] = min(max(stem[k - 1], op[k] - width / 2), op[k] + width / 2)
    return stem


def outputs(count: int, n: int = 4000, seed: int = 1) -> np.ndarray:
    """Outputs that drift around 50 %, shape (n, count)."""
    e = np.random.default_rng(seed).normal(size=(n, count))
    return np.asarray(50.0 + 5.0 * lfilter([0.1], [1.0, -0.99], e, axis=0))


def test_a_stem_with_backlash_is_the_position_of_its_own_output() -> None:
    """A stem with backlash belongs to its output. A lagging process, and a tag that two equal tags could explain,
    belong to no output.
    """
    op = outputs(4)
    noise = 0.02 * np.random.default_rng(2).normal(size=(len(op), 3))
    stem = stem_with_backlash(op[:, 0], 0.8) + noise[:, 0]
    lagging = lfilter([0.05], [1.0, -0.95], op[:, 1] - 50.0) + 50.0
    doubled = np.column_stack([op[:, 2], op[:, 2]]) + noise[:, 1:]
    values = np.column_stack([op, lagging, stem, doubled])
    assert positions(values, range(4), range(4, 8)) == {0: 5}


def test_the_mode_is_the_tag_with_one_value_in_which_the_output_is_constant() -> None:
    """A switch that stops one output is its mode; a switch at other times, or one that stops two outputs, is no
    mode.
    """
    op = outputs(3)
    on = np.ones((len(op), 3))
    on[500:900, 0] = on[2000:2600, 0] = 0.0
    on[1200:1800, 1:] = 0.0
    held = op.copy()
    for k in range(3):
        last_free = np.maximum.accumulate(np.where(on[:, k] > 0, np.arange(len(op)), 0))
        held[:, k] = op[last_free, k]
    late = np.roll(on[:, 0], 300)
    tags = [late, on[:, 0] * 4.0, on[:, 1]]
    assert modes({k: held[:, k] for k in range(3)}, tags) == {0: 1}


def test_a_tag_that_never_changes_or_counts_is_no_mode() -> None:
    """A mode has few values and changes them only sometimes."""
    assert not may_be_mode(np.ones(1000))
    assert not may_be_mode(np.arange(1000.0))
    assert may_be_mode(np.repeat([1.0, 0.0, 1.0], 300))


def test_a_draft_names_position_and_mode() -> None:
    """A loop that is found by data gets the tags of its position and of its mode, also if the mode is a text tag."""
    loop = pi_loop(2.0, 60.0, 0.5)
    manual = np.zeros(len(loop), dtype=bool)
    manual[1000:1600] = manual[4000:4300] = True
    last_free = np.maximum.accumulate(np.where(manual, 0, np.arange(len(loop))))
    op = loop[last_free, 2]
    stem = stem_with_backlash(op, 0.3) + 0.01 * np.random.default_rng(7).normal(size=len(op))
    values = np.column_stack([unrelated_tags(len(loop), 8, 3), loop[:, :2], op, stem])
    names = [f"T{k}" for k in range(values.shape[1])]
    row = by_data(Sampled(tuple(names), values, 1.0, {"M": manual.astype(float)}))[0]
    assert row.sure
    assert (row.spec.pv, row.spec.op, row.spec.sp) == ("T9", "T10", "T8")
    assert (row.spec.position, row.spec.mode) == ("T11", "M")
    assert "is constant only in one value of M" in row.evidence
