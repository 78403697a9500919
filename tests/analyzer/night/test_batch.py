"""A night over many loops: in one run, in pieces, and stopped and resumed."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner

from analyzer.belief import nights as believed
from analyzer.cli import main
from analyzer.columns import NIGHTS, names
from analyzer.commands import options
from analyzer.history.export import Export, open_export
from analyzer.loops.spec import LoopSpec
from analyzer.loops.tags import find_loops
from analyzer.night import batch, chunk, finish
from analyzer.night.nights import Plant
from analyzer.store.store import Store
from identification.errors import InputError
from proofs.plant import CONFIG, START_S, Sketch, Trends, simulate, write_export

LOOPS, CYCLING = 24, (0, 16)
"""Number of loops, and the loops that oscillate."""
BROKEN = "L17"
DAY = 86400.0


def quiet(seed: int, n: int) -> Trends:
    """A loop with noise whose controller moves OP a little, shape (n,) each."""
    rng = np.random.default_rng(seed)
    pv = 50 + np.convolve(rng.standard_normal(n + 9), np.ones(10) / 10, mode="valid")
    return Trends(np.full(n, 50.0), pv, 50 - 0.5 * (pv - 50), np.full(n, 50.0))


def at_rest(seed: int, n: int) -> Trends:
    """A loop with noise whose OP is constant, which needs no fit, shape (n,) each."""
    made = quiet(seed, n)
    return Trends(made.sp, made.pv, np.full(n, 50.0), made.stem)


def cycling(seed: int) -> Trends:
    """A quarter of an hour of a fast level loop with backlash."""
    return simulate(Sketch("valve", (80.0, 200.0, 1.0), 1.0, 10.0, backlash=1.0, load_std=0.1), 0.25, seed)


@pytest.fixture(scope="module")
def night(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An export of 24 loops: two oscillate, and one has no good PV."""
    made = {k: cycling(k) if k in CYCLING else (at_rest if k % 4 else quiet)(k, 900) for k in range(LOOPS)}
    loops = {f"L{k:02d}": trends for k, trends in made.items()}
    broken = loops[BROKEN]
    loops[BROKEN] = Trends(broken.sp, np.full(900, np.nan), broken.op, broken.stem)
    return write_export(tmp_path_factory.mktemp("night") / "night.parquet", loops)


def opened(path: Path) -> tuple[Export, tuple[LoopSpec, ...]]:
    """An export and the loops found in it."""
    export = open_export([path])
    return export, find_loops(export.tags)


def tables(store: Path) -> dict[str, list[dict[str, object]]]:
    """All rows of the finished tables of a store, in the order of loops and time."""
    found = {}
    for path in sorted(store.rglob("*.parquet")):
        rows = pq.read_table(path).to_pylist()
        key = lambda r: (r["loop"], r.get("hour_s", 0), r.get("time_s", 0))  # noqa: E731
        found[str(path.relative_to(store))] = sorted(rows, key=key)
    return found


@pytest.fixture(scope="module")
def whole(night: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The store of an uninterrupted run in one process."""
    store = tmp_path_factory.mktemp("whole") / "store"
    export, specs = opened(night)
    batch.run(Plant(export, specs, CONFIG), Store(store))
    return store


def test_one_broken_loop_loses_one_loop_only(night, tmp_path):
    """A night with one loop without data among 24 gives 23 results and one reason, on stderr and in the store."""
    store = tmp_path / "store"
    result = CliRunner().invoke(main, ["run", str(night), "--store", str(store), "--jobs", "2"])
    assert result.exit_code == 0
    lines = [line for line in result.stderr.splitlines() if line.startswith(BROKEN)]
    assert lines == [f"{BROKEN}: needs PV samples, has none that is good"]
    assert "23 of 24 loops assessed" in result.stderr
    rows = Store(store).read("nights", Store(store).require()).to_pylist()
    assert [r["loop"] for r in rows] == [f"L{k:02d}" for k in range(LOOPS)]
    assert [r["loop"] for r in rows if r["status"] != "ok"] == [BROKEN]
    lost = next(r for r in rows if r["loop"] == BROKEN)
    assert lost["status"] == "not assessed"
    assert lost["oscillation_significance"] is None


def test_an_error_of_one_loop_is_its_result(night, tmp_path, monkeypatch):
    """An error in the assessment of one loop is the reason of that loop only."""

    def fails(prepared, *rest):
        if prepared.record.tag == "L03":
            raise ZeroDivisionError("of all things")
        return assess(prepared, *rest)

    assess = chunk.assess
    monkeypatch.setattr(chunk, "assess", fails)
    export, specs = opened(night)
    outcome = batch.run(Plant(export, specs[:6], CONFIG), Store(tmp_path / "store"))
    assert outcome.failed == (("L03", "ZeroDivisionError: of all things"),)
    assert outcome.unassessed == ()


def test_every_cell_is_a_number_or_empty(whole):
    """No NaN is written into a store: unknown values are empty."""
    for name, rows in tables(whole).items():
        for row in rows:
            for column, value in row.items():
                assert not (isinstance(value, float) and np.isnan(value)), (name, column)


def test_a_row_has_all_columns_and_the_cycling_loops_are_found(whole):
    """The loops with backlash are found with their cause; the loops with noise have none."""
    rows = Store(whole).read("nights", Store(whole).require()).to_pylist()
    assert tuple(rows[0]) == names(NIGHTS)
    causes = {r["loop"]: r["cause"] for r in rows if r["status"] == "ok"}
    assert all(causes[f"L{k:02d}"] == "valve" for k in CYCLING)
    assert {cause for loop, cause in causes.items() if int(loop[1:]) % 8} == {"none"}


def stopped(night: Path, store: Path, chunks: int) -> None:
    """A run that is killed at the start of the chunk after `chunks` chunks."""
    done: list[str] = []
    work = chunk.work

    def killed(task: chunk.Task) -> chunk.Done:
        if len(done) == chunks:
            raise KeyboardInterrupt
        done.append(task.key)
        return work(task)

    export, specs = opened(night)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chunk, "work", killed)
        with pytest.raises(KeyboardInterrupt):
            batch.run(Plant(export, specs, CONFIG), Store(store))


def test_a_stopped_run_continues_at_the_same_place(night, whole, tmp_path, monkeypatch):
    """After half the chunks, --resume assesses the other loops, and the store is that of one complete run."""
    store = tmp_path / "store"
    stopped(night, store, 2)
    assert Store(store).nights() == []
    worked = []
    work = chunk.work
    monkeypatch.setattr(chunk, "work", lambda task: worked.extend(s.loop for s in task.specs) or work(task))
    export, specs = opened(night)
    batch.run(Plant(export, specs, CONFIG), Store(store), resume=True)
    assert worked == [f"L{k:02d}" for k in range(2 * batch.chunk_size(LOOPS), LOOPS)]
    assert tables(store) == tables(whole)
    assert Store(store).begun() == []


def test_a_chunk_stopped_half_written_is_not_stored_twice(night, whole, tmp_path):
    """A run killed between the pieces of one chunk continues with that chunk and stores its hours once."""
    store = tmp_path / "store"
    export, specs = opened(night)
    write, written = chunk.write_table, []

    def killed(table: pa.Table, path: Path) -> None:
        if path.name.startswith("nights-"):
            if written:
                raise KeyboardInterrupt
            written.append(path)
        write(table, path)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chunk, "write_table", killed)
        with pytest.raises(KeyboardInterrupt):
            batch.run(Plant(export, specs, CONFIG), Store(store))
    CliRunner().invoke(main, ["run", str(night), "--store", str(store), "--resume", "--jobs", "2"])
    assert tables(store) == tables(whole)


def test_a_run_of_other_code_is_not_continued(night, tmp_path, monkeypatch):
    """Pieces of a run that was stopped before an update are refused in one line; a run without --resume starts."""
    export, specs = opened(night)
    mine, kept = Plant(export, specs[:4], CONFIG), Store(tmp_path / "store")
    kept.run_file.parent.mkdir(parents=True, exist_ok=True)
    with monkeypatch.context() as older:
        older.setattr(batch, "of_code", lambda: b"another")
        kept.run_file.write_text(json.dumps(batch.identity(mine)), encoding="utf-8")
    with pytest.raises(InputError, match="and version"):
        batch.run(mine, kept, resume=True)
    batch.run(mine, kept)
    assert kept.nights() == ["2026-03-02"]


def test_without_resume_a_run_starts_again(night, whole, tmp_path):
    """Pieces of an older run are deleted without --resume."""
    store = tmp_path / "store"
    stopped(night, store, 1)
    CliRunner().invoke(main, ["run", str(night), "--store", str(store), "--jobs", "2"])
    assert tables(store) == tables(whole)


def test_two_processes_give_the_result_of_one(night, whole, tmp_path):
    """Two workers write the same store as one process."""
    export, specs = opened(night)
    store = tmp_path / "store"
    batch.run(Plant(export, specs, CONFIG), Store(store), jobs=2)
    assert tables(store) == tables(whole)


def test_a_night_put_together_in_small_parts_is_the_same(night, whole, tmp_path, monkeypatch):
    """Tables that are read and written three loops at a time have the rows of tables in one part.

    Reading some loops gives the same rows.
    """
    monkeypatch.setattr(finish, "CHUNKS_AT_ONCE", 1)
    monkeypatch.setattr(finish, "LOOPS_AT_ONCE", 3)
    monkeypatch.setattr(believed, "LOOPS_AT_ONCE", 7)
    export, specs = opened(night)
    store = Store(tmp_path / "store")
    batch.run(Plant(export, specs, CONFIG), store)
    assert tables(store.path) == tables(whole)
    assert pq.ParquetFile(store.file("nights", store.nights()[-1])).num_row_groups == LOOPS // 3
    for table in ("nights", "hours", "trends", "beliefs"):
        some = [store.read(table, store.nights()[-1]).to_pylist() for store in (store, Store(whole))]
        wanted = {"L03", "L08", "L39"}
        kept = [r for r in some[1] if r["loop"] in wanted]
        names = list(kept[0])
        assert store.own_rows(table, store.nights()[-1], names, wanted) == kept
        assert store.own_rows(table, store.nights()[-1], names, []) == []


def test_progress_counts_all_loops(night, tmp_path):
    """Progress goes from zero to all loops."""
    export, specs = opened(night)
    reported: list[tuple[int, int]] = []
    batch.run(
        Plant(export, specs[:20], CONFIG),
        Store(tmp_path / "s"),
        progress=lambda d, t: reported.append((d, t)),
    )
    assert reported == [(k, 20) for k in range(0, 21, 4)]


def test_progress_counts_loops_of_chunks_in_progress(night, tmp_path):
    """With worker processes progress never decreases, ends with all loops, and counts loops within a chunk."""
    export, specs = opened(night)
    reported = []
    plant = Plant(export, specs, CONFIG)
    batch.run(plant, Store(tmp_path / "s"), 1, progress=lambda done, of: reported.append((done, of)))
    counts = [done for done, _ in reported]
    assert counts == sorted(counts)
    assert reported[0] == (0, LOOPS)
    assert reported[-1] == (LOOPS, LOOPS)
    assert any(done % batch.chunk_size(LOOPS) for done in counts)


def test_a_run_reports_its_start_and_long_steps(capsys, monkeypatch):
    """The progress lines begin with zero, and say once that a first run compiles if nothing is done for long.

    If nothing new is done for a minute, the progress is repeated.
    """
    progress = options._tenths("loops")
    progress(0, 40)
    monkeypatch.setattr(options, "COMPILING_S", -1.0)
    for done in (0, 0, 3, 4, 4, 40):
        progress(done, 40)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "loops: 0 of 40"
    assert "compiles" in lines[1]
    assert lines[2:] == ["loops: 4 of 40", "loops: 40 of 40"]
    monkeypatch.setattr(options, "STILL_S", -1.0)
    progress(40, 40)
    assert capsys.readouterr().err.startswith("loops: 40 of 40 after ")


def test_a_run_begins_with_a_line_before_it_reads(tmp_path):
    """The first line on stderr names the input before any numerical package is imported."""
    export, seen = tmp_path / "day.csv", tmp_path / "seen"
    export.write_text("timestamp,FIC1.PV\n")
    show = f"""
import sys
from contextlib import contextmanager
import analyzer.cli, analyzer.commands.run as run
@contextmanager
def watched(what):
    heavy = sorted({{"numba", "pandas", "scipy", "statsmodels", "matplotlib", "dask"}} & set(sys.modules))
    open({str(seen)!r}, "w").write(f"{{what}}|{{heavy}}")
    yield
run.watched = watched
analyzer.cli.main()
"""
    arguments = [sys.executable, "-c", show, "run", str(export), "--store", str(tmp_path / "store")]
    subprocess.run(arguments, capture_output=True, check=False)
    what, heavy = seen.read_text().split("|")
    assert what == f"reading {export}"
    assert heavy == "[]"


@pytest.mark.slow
def test_two_weeks_are_fourteen_nights(tmp_path):
    """An export of two weeks is divided at midnight into 14 nights, each with all loops and 24 hours."""
    n = 14 * 1440
    loops = {f"L{k}": quiet(k, n) for k in range(2)}
    path = write_export(tmp_path / "weeks.parquet", loops, dt_s=60.0)
    result = CliRunner().invoke(main, ["run", str(path), "--store", str(tmp_path / "store")])
    assert result.exit_code == 0
    store = Store(tmp_path / "store")
    assert store.nights() == [f"2026-03-{day:02d}" for day in range(2, 16)]
    for night in store.nights():
        assert store.read("nights", night).num_rows == 2
        hours = [r["hour_s"] for r in store.rows("hours", night, ["hour_s"], ["L0"])]
        assert len(hours) == 24
        assert len({h // DAY for h in hours}) == 1


def test_since_and_until_choose_days(tmp_path):
    """With --since and --until only the days between them are assessed."""
    path = write_export(tmp_path / "weeks.parquet", {"L0": quiet(0, 14 * 1440)}, dt_s=60.0)
    arguments = ["--since", "2026-03-05", "--until", "2026-03-08"]
    CliRunner().invoke(main, ["run", str(path), "--store", str(tmp_path / "store"), *arguments])
    assert Store(tmp_path / "store").nights() == ["2026-03-05", "2026-03-06", "2026-03-07"]


def test_recordings_of_different_days_are_one_night(tmp_path):
    """Short recordings of different days in a folder are one night, and each one is assessed completely."""
    for k in range(3):
        write_export(tmp_path / f"{k}.parquet", {f"L{k}": quiet(k, 7200)}, START_S + 9 * DAY * k)
    result = CliRunner().invoke(main, ["run", str(tmp_path), "--store", str(tmp_path / "store")])
    assert result.exit_code == 0, result.stderr
    store = Store(tmp_path / "store")
    assert store.nights() == ["2026-03-20"]
    rows = store.read("nights", "2026-03-20").to_pylist()
    assert [(r["loop"], r["duration_s"]) for r in rows] == [(f"L{k}", 7200.0) for k in range(3)]
    assert [r["start_s"] for r in rows] == [START_S + 9 * DAY * k for k in range(3)]


def test_a_night_in_progress_is_not_read(night, whole, tmp_path):
    """Pieces of a night in progress are not yet a night."""
    store = Store(tmp_path / "store")
    stopped(night, store.path, 1)
    assert store.nights() == []
    result = CliRunner().invoke(main, ["rank", str(store.path)])
    assert result.exit_code == 2
    assert "no complete night in it" in result.stderr


MEASURE = """
import json, resource, sys
from pathlib import Path
from analyzer.night import batch
from analyzer.night.nights import Plant
from analyzer.config import Config
from analyzer.history.export import open_export
from analyzer.store.store import Store
from analyzer.loops.tags import find_loops
export = open_export([Path(sys.argv[1])])
peak = {}
measured = lambda done, of: peak.update({done: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss})
batch.run(Plant(export, find_loops(export.tags), Config()), Store(Path(sys.argv[2])), progress=measured)
print(json.dumps(peak))
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no resource module")
def test_memory_does_not_grow_with_the_number_of_loops(tmp_path):
    """Sixty loops of 24 h, 140 MB of samples, need at most 1.3 times the memory of the first fifteen."""
    n = 86_400
    stamp = np.round((START_S + np.arange(n)) * 1e6).astype("datetime64[us]")
    columns: dict[str, object] = {"timestamp": pa.array(stamp)}
    for k in range(60):
        columns |= {f"L{k:02d}.{role}": getattr(quiet(k, n), role.lower()) for role in ("PV", "OP")}
    pq.write_table(pa.table(columns), tmp_path / "day.parquet", compression=None, use_dictionary=False)
    command = [sys.executable, "-c", MEASURE, str(tmp_path / "day.parquet"), str(tmp_path / "store")]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    peak = {int(loops): most for loops, most in json.loads(done.stdout).items()}
    assert peak[60] < 1.3 * max(most for loops, most in peak.items() if loops <= 15), peak
