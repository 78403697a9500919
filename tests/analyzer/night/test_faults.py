"""A night that is killed, stopped, disturbed or run twice: nothing is lost or done twice, and each event is
reported.
"""

from __future__ import annotations

import contextlib
import json
import os
import pickle
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner, Result

from analyzer.cli import main
from analyzer.night import opened
from analyzer.store.lock import locked
from analyzer.store.store import Store
from identification.errors import InputError
from proofs.plant import START_S, write_export
from tests.analyzer.night.test_batch import quiet, tables

LOOPS = 24
slow = partial(pytest.param, marks=pytest.mark.slow)
linux = pytest.mark.skipif(sys.platform != "linux", reason="processes are looked for in /proc")


@pytest.fixture(scope="module")
def export(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An export of 24 loops that do not oscillate, an hour at 1 s."""
    loops = {f"L{k:02d}": quiet(k, 3600) for k in range(LOOPS)}
    return write_export(tmp_path_factory.mktemp("faults") / "night.parquet", loops)


@pytest.fixture(scope="module")
def whole(export: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[dict[str, object]]]:
    """The tables of an undisturbed run."""
    store = tmp_path_factory.mktemp("whole") / "store"
    subprocess.run(command(export, store), check=True, capture_output=True)
    return tables(store)


def stated(export: Path) -> list[str]:
    """Options with loops.csv and changes.csv for the loops of an export, written in its folder; one loop has several
    rows.
    """
    loops = [name[:-3] for name in pq.read_schema(export).names if name.endswith(".PV")]
    path, changes = export.with_suffix(".loops.csv"), export.with_suffix(".changes.csv")
    head = "loop,area,sp,pv,op,pv_lo,pv_hi,kp,ti,form,gain_unit,ti_unit,op_unit,valid_from\n"
    row = "{0},Washing,{0}.SP,{0}.PV,{0}.OP,0,100,{1},60,ideal,percent,s,%,{2}\n"
    rows = [row.format(n, 1 + int(n[1:]) / 10, "") for n in loops]
    rows += [row.format(n, 2, "2026-03-02 00:20") for n in loops if n == "L05"]
    path.write_text("".join([head, *rows]))
    changed = [f"{n},2026-03-0{2 if n == 'L00' else 1} 00:30,0.5,1,AB\n" for n in loops]
    changes.write_text("".join(["loop,time,kp_old,kp_new,who\n", *changed]))
    return ["--loops", str(path), "--changes", str(changes)]


def command(export: Path, store: Path, *more: str) -> list[str]:
    """The batch as a separate process, as in a plant."""
    return [
        *(sys.executable, "-m", "analyzer.cli", "run", str(export), *stated(export)),
        *("--store", str(store), "--jobs", "2", *more),
    ]


def seeded(seed: int) -> dict[str, str]:
    """The environment of a process with another order of sets."""
    return {**os.environ, "PYTHONHASHSEED": str(seed)}


def children(pid: int) -> list[int]:
    """Worker processes of a run, except the server of workers."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            fields = path.read_text().rpartition(")")[2].split()
            line = (path.parent / "cmdline").read_text()
            if int(fields[1]) == pid and fields[0] != "Z" and "spawn_main" in line:
                found.append(int(path.parent.name))
    return found


@pytest.fixture(autouse=True)
def as_from_a_terminal() -> Iterator[None]:
    """Signals as a terminal leaves them: a test run under nohup, or in the background, passes on ignored signals."""
    handlers = {signal.SIGINT: signal.default_int_handler, signal.SIGHUP: signal.SIG_DFL}
    before = {number: signal.signal(number, handler) for number, handler in handlers.items()}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@contextlib.contextmanager
def running(export: Path, store: Path, *more: str) -> Iterator[subprocess.Popen[str]]:
    """A run in a separate process, given after it has written its first piece."""
    arguments = command(export, store, *more)
    with subprocess.Popen(arguments, stderr=subprocess.PIPE, text=True, env=seeded(1)) as run:
        while run.poll() is None and not list(store.glob("parts/*/nights-*.parquet")):
            time.sleep(0.005)
        yield run
        if run.poll() is None:
            run.kill()


@linux
def test_a_killed_worker_loses_no_loop(export, whole, tmp_path):
    """A worker that is killed once is replaced, and its loop is tried again: the store is that of an undisturbed
    run.
    """
    store = tmp_path / "store"
    with running(export, store) as run:
        for worker in children(run.pid)[:1]:
            os.kill(worker, signal.SIGKILL)
        _, output = run.communicate(timeout=120)
    assert run.returncode == 0, output
    assert "Traceback" not in output
    assert tables(store) == whole


@pytest.fixture(scope="module")
def killed(export: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[int]]:
    """The store of a run that is killed after its first piece, and the workers of that run."""
    store = tmp_path_factory.mktemp("killed") / "store"
    with running(export, store) as run:
        workers = children(run.pid) if sys.platform == "linux" else []
        run.kill()
        run.wait()
    return store, workers


@pytest.fixture
def begun(killed: tuple[Path, list[int]], tmp_path: Path) -> Path:
    """A copy of the store of a run that was killed after its first piece."""
    return shutil.copytree(killed[0], tmp_path / "store")


@linux
def test_a_run_killed_with_signal_9_continues_with_resume(export, whole, killed, begun):
    """After kill -9 of the parent its workers have ended.

    --resume in a process with another order of sets gives the store of an undisturbed run.
    """
    again = command(export, begun, "--resume")
    done = subprocess.run(again, capture_output=True, text=True, check=False, env=seeded(2))
    assert done.returncode == 0, done.stderr
    assert not set(killed[1]) & {int(p.name) for p in Path("/proc").glob("[0-9]*")}
    assert tables(begun) == whole


@linux
@pytest.mark.parametrize("number", [signal.SIGTERM, slow(signal.SIGINT), slow(signal.SIGHUP)])
def test_a_stopped_run_ends_at_once_and_says_how_to_continue(export, tmp_path, number):
    """SIGTERM, SIGINT and SIGHUP end run and workers, with one line that names --resume and no traceback."""
    store = tmp_path / "store"
    with running(export, store) as run:
        workers = children(run.pid)
        run.send_signal(number)
        _, output = run.communicate(timeout=30)
    assert run.returncode == 128 + number
    last = output.strip().splitlines()[-1]
    assert "--resume" in last
    assert number.name in last
    assert "Traceback" not in output
    assert not set(workers) & {int(p.name) for p in Path("/proc").glob("[0-9]*")}


@pytest.mark.slow
@linux
def test_a_run_under_nohup_continues_without_its_terminal(export, whole, tmp_path):
    """If SIGHUP is ignored, as under nohup, the run continues."""
    store = tmp_path / "store"
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with running(export, store) as run:
            run.send_signal(signal.SIGHUP)
            _, output = run.communicate(timeout=120)
    finally:
        signal.signal(signal.SIGHUP, before)
    assert run.returncode == 0, output
    assert tables(store) == whole


def test_a_change_of_an_unknown_loop_is_reported(export, tmp_path):
    """A loop of changes.csv that is missing from loops.csv is named by `check` and by `run`."""
    changes = tmp_path / "changes.csv"
    changes.write_text("loop,time,kp_old,kp_new,who\nL00,2026-03-01,1,1.5,AB\nFIC9,2026-03-01,1,1.5,AB\n")
    more = (str(export), *stated(export), "--changes", str(changes))
    for words in (("check", *more), ("run", *more, "--store", str(tmp_path / "store"))):
        result = CliRunner().invoke(main, words)
        assert result.exit_code == 0, result.output
        assert "--changes: FIC9: no such loop is read" in result.output
        assert "L00: no such" not in result.output


def test_two_runs_on_one_store_exclude_each_other(export, whole, tmp_path):
    """A run on a store in use ends with exit 2 and one line with the owner; a later run succeeds."""
    store = tmp_path / "store"
    with locked(store):
        second = ran(export, store)
        assert second.exit_code == 2
        assert f"{store}: in use by process {os.getpid()} of " in second.stderr
        assert second.stderr.count("\n") == 1
    assert ran(export, store).exit_code == 0
    assert tables(store) == whole


def test_a_lock_of_a_dead_owner_is_ignored(export, tmp_path):
    """The lock and the owner's name of a process that has ended stop no run."""
    store = tmp_path / "store"
    store.mkdir()
    (store / "run.lock").touch()
    (store / "run.owner.json").write_text('{"user": "x", "host": "y", "process": 1, "since": "yesterday"}')
    assert ran(export, store).exit_code == 0


def ran(export: Path, store: Path, *more: str) -> Result:
    """The batch in this process, with one worker."""
    return CliRunner().invoke(main, ["run", str(export), *stated(export), "--store", str(store), *more])


def part(export: Path, out: Path, loops: range, rows: int | None = None) -> Path:
    """An export with some loops of another one, cut after some rows."""
    table = pq.read_table(export)
    names = [f"L{k:02d}.{role}" for k in loops for role in ("SP", "PV", "OP")]
    pq.write_table(table.select(["timestamp", *names]).slice(0, rows), out)
    return out


def test_a_second_export_of_a_night_adds_its_loops(export, whole, tmp_path):
    """If two units export the same night one after the other, the store contains the loops of both, as in one run."""
    store = tmp_path / "store"
    first = part(export, tmp_path / "a.parquet", range(16))
    second = part(export, tmp_path / "b.parquet", range(16, LOOPS))
    assert ran(first, store).exit_code == 0
    result = ran(second, store)
    assert result.exit_code == 0
    assert "16 loops of an earlier run are also kept" in result.stderr
    assert tables(store) == whole


@pytest.mark.slow
def test_the_fuller_record_of_a_loop_is_kept(export, whole, tmp_path):
    """An hour of a loop is not replaced by twenty minutes of it, but the reverse is done, with a message."""
    short = part(export, tmp_path / "short.parquet", range(2), 1200)
    store = tmp_path / "store"
    ran(export, store)
    result = ran(short, store)
    assert "L00: the store has 1.0 good hours of night 2026-03-02, this export 0.3" in result.stderr
    assert tables(store) == whole
    replaced = ran(short, store, "--replace")
    assert replaced.exit_code == 0
    assert Store(store).read("nights", "2026-03-02").num_rows == 2
    ran(export, store)
    assert tables(store) == whole


def test_a_good_night_is_not_lost_to_an_empty_one(export, whole, tmp_path):
    """An export of the same night without a good sample does not change the stored night."""
    store = tmp_path / "store"
    ran(export, store)
    table = pq.read_table(export)
    empty = {
        n: table[n] if n == "timestamp" else pa.nulls(table.num_rows, pa.float64())
        for n in table.column_names
    }
    pq.write_table(pa.table(empty), tmp_path / "empty.parquet")
    ran(tmp_path / "empty.parquet", store)
    assert tables(store) == whole


def test_pieces_of_two_exports_are_never_mixed(export, begun, tmp_path):
    """--resume with another export than that of the stopped run is refused, with the name of its export."""
    other = part(export, tmp_path / "other.parquet", range(16, LOOPS))
    result = ran(other, begun, "--resume")
    assert result.exit_code == 2
    assert "the run that was stopped read night.parquet (24 loops" in result.stderr
    assert ran(export, begun, "--resume").exit_code == 0


def test_a_run_continues_with_its_own_limits_only(export, begun, tmp_path):
    """--resume with other limits than those of the stopped run is refused and names --config as an option that must
    be the same.
    """
    limits = tmp_path / "limits.toml"
    limits.write_text("[oscillation]\nperiods = 3.5\n")
    result = ran(export, begun, "--resume", "--config", str(limits))
    assert result.exit_code == 2
    assert "--config" in result.stderr
    limits.write_text("[oscillation]\nperiods = 3.0\n")
    assert ran(export, begun, "--resume", "--config", str(limits)).exit_code == 0


@pytest.mark.parametrize("year", [slow(1601), 1970, slow(2106)])
def test_a_stray_stamp_makes_no_nights(export, whole, tmp_path, year):
    """One stamp far from the others is removed and reported; the night is the same as without it."""
    table = pq.read_table(export)
    first = table.slice(0, 1).set_column(
        0, "timestamp", pa.array([f"{year}-01-05 00:00:00"]).cast(table.schema.field("timestamp").type)
    )
    pq.write_table(pa.concat_tables([first, table]), tmp_path / "stray.parquet")
    store = tmp_path / "store"
    result = ran(tmp_path / "stray.parquet", store)
    assert result.exit_code == 0, result.output
    assert "1 stamps lie far from the rest of their file and are set aside" in result.stderr
    assert tables(store) == whole
    checked = CliRunner().invoke(main, ["check", str(tmp_path / "stray.parquet")])
    assert checked.exit_code == 0
    assert "24 loops, 2026-03-02 00:00 to 2026-03-02 00:59 UTC" in checked.output


def test_a_gap_of_days_makes_no_empty_nights(tmp_path):
    """Two days of data with two days without data between them give two nights, and the others are reported."""
    a = write_export(tmp_path / "a.parquet", {"L0": quiet(0, 1440)}, START_S, 60.0)
    b = write_export(tmp_path / "b.parquet", {"L0": quiet(1, 1440)}, START_S + 3 * 86400.0, 60.0)
    both = pa.concat_tables([pq.read_table(a), pq.read_table(b)])
    for path in (a, b):
        path.unlink()
    pq.write_table(both, tmp_path / "both.parquet")
    result = ran(tmp_path / "both.parquet", tmp_path / "store")
    assert Store(tmp_path / "store").nights() == ["2026-03-02", "2026-03-05"], result.output
    assert "2 nights without a good sample of any loop are left out" in result.stderr


@pytest.mark.slow
def test_explanations_of_other_loops_are_kept(export, tmp_path):
    """Explanations of loops that a second export does not contain are kept; those of replaced records are not."""
    store = Store(tmp_path / "store")
    ran(part(export, tmp_path / "a.parquet", range(4)), store.path)
    night = store.nights()[-1]
    rows = pa.table({"loop": ["L00", "L03"], "answer": [json.dumps({}), json.dumps({})]})
    store.write("explained", night, rows)
    ran(part(export, tmp_path / "b.parquet", range(3, 6)), store.path)
    kept = store.read("explained", night)
    assert pc.unique(kept.column("loop")).to_pylist() == ["L00"]


def dies(arguments: object, began: object) -> None:
    """Replacement of the search in an export: the process is ended by the system."""
    os.kill(os.getpid(), signal.SIGKILL)


@linux
def test_a_process_that_dies_while_reading_is_reported_in_one_line(export, tmp_path, monkeypatch):
    """If the process that examines an export is ended, the run ends with exit 2 and one line."""
    monkeypatch.setattr(opened, "opened_with_spans", dies)
    result = ran(export, tmp_path / "store")
    assert result.exit_code == 2
    assert "reading it ended without a result (its worker process was ended by SIGKILL" in result.stderr
    assert result.stderr.count("\n") == 1


def test_an_input_error_is_passed_between_processes():
    """An InputError is unchanged after it comes from a worker."""
    error = InputError("seen", "expected", "remedy")
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.seen, again.expected, again.remedy) == (
        str(error),
        "seen",
        "expected",
        "remedy",
    )


def small_files(most: int) -> None:
    """Limit the size of files that this process writes, as on a full disk."""
    import resource

    resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))


@linux
@pytest.mark.parametrize("most", [512, slow(20_000)])
def test_a_full_disk_names_the_file_and_resume(export, whole, tmp_path, most):
    """If there is no room to write, one line names the file and --resume; with room the run continues."""
    store = tmp_path / "store"
    arguments = command(export, store)
    done = subprocess.run(
        arguments, capture_output=True, text=True, check=False, preexec_fn=lambda: small_files(most)
    )
    assert done.returncode == 2, done.stderr
    last = done.stderr.strip().splitlines()[-1]
    assert str(store) in last.partition(": ")[2].partition(": ")[0]
    assert "make room" in last
    assert "--resume" in last
    assert "Traceback" not in done.stderr
    assert ran(export, store, "--resume").exit_code == 0
    assert tables(store) == whole
