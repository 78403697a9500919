"""Readers under a coverage-guided fuzzer: python -m proofs.fuzz.readers CORPUS [OPTIONS]

    pip install atheris
    python -m proofs.fuzz.readers CORPUS -max_total_time=3600 -timeout=25 -rss_limit_mb=2048 -max_len=6000

The first byte selects the type of the rest: an export, a loops.csv, a changes.csv, a model, a configuration. Every
input must be read, or refused by an InputError. Any other result ends the run and saves the input. CORPUS is first
filled with small files of every dialect of proofs/dialects. Each finding must be kept as a test
(tests/proofs/fuzz/test_findings.py); there is no finding so far.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from identification.errors import TriageError

SEEDS_BYTES = 6000
"""Bytes of a seed that are used."""


def _export(path: Path) -> None:
    from analyzer.history.export import open_export
    from analyzer.history.table import ReadOptions

    with tempfile.TemporaryDirectory() as scratch:
        found = open_export([path], ReadOptions(scratch=Path(scratch)))
        found.span()
        found.read(list(found.tags[:12]))


def _loops(path: Path) -> None:
    from analyzer.loops.tags import match, read_loops

    match(read_loops(path), ["FIC1.PV", "FIC1.OP", "FIC1.SP"])


def _changes(path: Path) -> None:
    from analyzer.loops.changes import read_changes

    read_changes(path)


def _model(path: Path) -> None:
    from analyzer.explain.models import read_model

    read_model(path, "FIC1")


def _config(path: Path) -> None:
    from analyzer.config import read_config

    read_config(path)


READERS: tuple[tuple[str, Callable[[Path], None]], ...] = (
    ("export.csv", _export),
    ("loops.csv", _loops),
    ("changes.csv", _changes),
    ("model.json", _model),
    ("config.toml", _config),
)
"""File name and reader, by the first byte of an input; exports use the other values."""


def read(data: bytes) -> bool:
    """Read one input; whether it was readable.

    Raises
    ------
    Exception
        Any exception that is not a refusal: a finding.
    """
    kind = data[0] if data else 0
    name, reader = READERS[kind if kind < len(READERS) else 0]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        path.write_bytes(data[1:])
        try:
            reader(path)
        except TriageError:
            return False
    return True


def fill(corpus: Path) -> None:
    """Write a small file of each dialect, and of each other type, into an empty corpus."""
    from proofs.dialects.make import main as make

    corpus.mkdir(parents=True, exist_ok=True)
    if any(corpus.iterdir()):
        return
    with tempfile.TemporaryDirectory() as folder:
        make(Path(folder))
        files = [p for p in Path(folder).rglob("*") if p.is_file() and p.suffix != ".json"]
        for k, path in enumerate(files):
            (corpus / f"export{k:04d}").write_bytes(b"\x05" + path.read_bytes()[:SEEDS_BYTES])
    texts = {
        1: "loop,pv,sp,op,pv_lo,pv_hi,kp,ti,form,valid_from\nFIC1,FIC1.PV,FIC1.SP,FIC1.OP,0,100,1.2,40,ideal,\n",
        2: "loop,time,kp,ti\nFIC1,2026-03-04 08:00,1.1,60\n",
        3: '{"format": 1, "loop": "FIC1"}',
        4: "[oscillation]\nperiods = 3\n",
    }
    for kind, text in texts.items():
        (corpus / f"other{kind}").write_bytes(bytes([kind]) + text.encode())


def main() -> None:
    """Fill the corpus and start the fuzzer."""
    import atheris  # type: ignore[import-not-found]

    fill(Path(sys.argv[1]))
    with atheris.instrument_imports(include=["analyzer"]):
        import analyzer.config
        import analyzer.explain.models
        import analyzer.history.export
        import analyzer.loops.changes
        import analyzer.loops.tags  # noqa: F401
    atheris.Setup(sys.argv, read)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
