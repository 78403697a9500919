"""The fuzzer's seed files and some mutants of them are read, or refused in one line."""

from __future__ import annotations

import numpy as np
import pytest

from proofs.fuzz.readers import READERS, fill, read


@pytest.fixture(scope="module")
def seeds(tmp_path_factory) -> list[bytes]:
    """Small files of every dialect and kind."""
    corpus = tmp_path_factory.mktemp("corpus")
    fill(corpus)
    return [path.read_bytes() for path in sorted(corpus.iterdir())]


def test_every_seed_is_read_or_refused(seeds):
    """Starts of exports of every dialect, and a file of each other kind, cause no unexpected error, and most
    are read."""
    assert {data[0] for data in seeds} == {1, 2, 3, 4, 5}
    assert sum(read(data) for data in seeds) > 0.7 * len(seeds)


def test_mutants_are_read_or_refused(seeds):
    """Bytes that are changed, doubled, dropped or swapped between files cause no unexpected error."""
    rng, understood = np.random.default_rng(7), 0
    for k in range(150):
        data = bytearray(seeds[k % len(seeds)])
        for _ in range(int(rng.integers(1, 6))):
            at, size = int(rng.integers(1, len(data) + 1)), int(rng.integers(1, 40))
            other = seeds[int(rng.integers(len(seeds)))]
            cut = other[1:][int(rng.integers(max(len(other) - 1, 1))) :][:size]
            data[at : at + int(rng.integers(0, size))] = cut if rng.random() < 0.5 else rng.bytes(size // 8)
        understood += read(bytes(data))
    assert 20 < understood < 150


def test_the_first_byte_selects_the_reader(tmp_path):
    """Each kind of input reaches its own reader. An input with an unknown first byte is read as an export."""
    assert [name for name, _ in READERS][1:] == ["loops.csv", "changes.csv", "model.json", "config.toml"]
    assert read(b"\x01loop,pv\nFIC1,FIC1.PV\n")
    assert not read(b"\x03{}")
    assert read(b"\xfftimestamp,FIC1.PV\n2026-03-02 00:00:00,1\n2026-03-02 00:00:01,2\n")
