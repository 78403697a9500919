"""Worker processes that die, hang, or exceed memory or time lose only their own item."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analyzer.config import WorkerLimits
from analyzer.night import own_limits
from analyzer.night.workers import Began, WorkerDeath, Workers

LIMITS = WorkerLimits(memory_mb=512.0, processor_s=600.0, wall_s=6000.0)
"""A memory limit that has an effect, and time limits that no busy machine reaches; tests of time have their own
limits.
"""
posix = pytest.mark.skipif(sys.platform == "win32", reason="signals and limits of a POSIX system")
linux = pytest.mark.skipif(sys.platform != "linux", reason="the limit of memory is Linux's")


def act(task: tuple[str, ...], began: Began) -> tuple[str, ...]:
    """Process a task of words; some of them cause damage."""
    done = []
    for at, word in enumerate(task):
        began(at)
        if word == "killed":
            os.kill(os.getpid(), signal.SIGKILL)
        if word == "spinning":
            while True:
                pass
        if word == "hanging":
            time.sleep(600)
        if word == "greedy":
            try:
                np.ones(2_000_000_000)
            except MemoryError:
                word = "no memory"
        if word.startswith("$"):
            word = os.environ.get(word[1:], "unset")
        if word == "deaf":
            word = str(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ()))
        if word == "mask":
            word = oct(os.umask(0o22))
        if word == "computing":
            sum(range(10**11))  # one call, during which no other thread of this process runs
        if word == "wrong":
            raise ValueError("of all things")
        done.append(word)
    return tuple(done)


def carried_out(
    *tasks: tuple[str, ...], limits: WorkerLimits = LIMITS
) -> list[tuple[str, ...] | WorkerDeath[tuple[str, ...]]]:
    """The results of two workers for some tasks."""
    with Workers(2, act, limits) as workers:
        for task in tasks:
            workers.submit(task)
        return list(workers.results())


def test_all_tasks_come_back_once():
    """Twenty tasks on two workers come back once each."""
    tasks = [(f"a{k}", f"b{k}") for k in range(20)]
    assert sorted(carried_out(*tasks)) == sorted(tasks)


@posix
def test_a_killed_worker_loses_its_item_and_the_others_continue():
    """A worker that is killed reports its current item; all other tasks are done."""
    found = carried_out(("a", "killed", "b"), ("c",), ("d",), ("e",))
    died = [r for r in found if isinstance(r, WorkerDeath)]
    assert [(d.task, d.at, d.again) for d in died] == [(("a", "killed", "b"), 1, True)]
    assert "SIGKILL" in died[0].why
    assert sorted(r for r in found if not isinstance(r, WorkerDeath)) == [("c",), ("d",), ("e",)]


@linux
def test_a_greedy_item_gets_a_memory_error():
    """An item that requests 16 GB under a limit of 0.5 GB gets a MemoryError, and the worker continues."""
    assert carried_out(("greedy", "a")) == [("no memory", "a")]


@posix
def test_an_item_that_computes_forever_is_ended():
    """An item over its processor time ends its worker, with that reason and no second try."""
    (died,) = carried_out(("a", "spinning"), limits=replace(LIMITS, processor_s=2.0))
    assert isinstance(died, WorkerDeath)
    assert (died.at, died.again) == (1, False)
    assert "2 s of processor time" in died.why


def test_an_item_that_hangs_is_ended():
    """An item that waits forever without computing is ended after its time limit."""
    (died,) = carried_out(("hanging",), limits=replace(LIMITS, wall_s=6.0))
    assert isinstance(died, WorkerDeath)
    assert (died.at, died.again) == (0, False)
    assert "longer than 6 s" in died.why


def test_an_error_of_the_function_reaches_the_caller():
    """An error of the function is raised where the results are read."""
    with pytest.raises(ValueError, match="of all things"):
        carried_out(("wrong",))


def test_a_task_that_must_run_alone_waits_for_the_others():
    """A task that must run alone starts when no other task is in progress."""
    with Workers(2, act, LIMITS) as workers:
        workers.submit(("alone",), alone=True)
        for k in range(6):
            workers.submit((str(k),))
        assert list(workers.results())[-1] == ("alone",)


PARENT = """
import sys
sys.path.insert(0, sys.argv[1])
from test_workers import LIMITS, act
from analyzer.night.workers import Workers
if __name__ == "__main__":
    with Workers(2, act, LIMITS) as workers:
        workers.submit(("hanging",)); workers.submit(("computing",))
        workers._feed()
        for worker in workers._workers:
            worker.pipe.poll(60)  # until it says that it has begun
        print(*(w.process.pid for w in workers._workers), flush=True)
        list(workers.results())
"""


def alive(pid: int) -> bool:
    """Whether a process runs (a zombie does not)."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@linux
def test_workers_end_with_their_parent(tmp_path):
    """If the parent is killed with signal 9, its workers end, also one within a single long call."""
    script = tmp_path / "parent.py"
    script.write_text(PARENT)
    command = [sys.executable, str(script), str(Path(__file__).parent)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        workers = [int(pid) for pid in parent.stdout.readline().split()]
        assert len(workers) == 2
        time.sleep(0.2)
        assert all(alive(pid) for pid in workers)
        parent.kill()
        parent.wait()
    for _ in range(200):
        if not any(alive(pid) for pid in workers):
            break
        time.sleep(0.05)
    assert [pid for pid in workers if alive(pid)] == []


def test_workers_see_the_environment_as_it_is_when_they_start(monkeypatch: pytest.MonkeyPatch):
    """A password that is set after the first workers have run is visible to the next ones; a removed one is not."""
    carried_out(("a",))
    monkeypatch.setenv("TRIAGE_SECRET", "now")
    assert carried_out(("$TRIAGE_SECRET",)) == [("now",)]
    monkeypatch.delenv("TRIAGE_SECRET")
    assert carried_out(("$TRIAGE_SECRET",)) == [("unset",)]


@linux
def test_the_server_blocks_keyboard_interrupts_at_its_start():
    """Ctrl-C, which reaches all processes of a terminal, is blocked in the server from its first instruction on.

    It is also blocked in the workers that the server forks.
    """
    assert carried_out(("deaf",)) == [("True",)]


@posix
def test_files_of_workers_have_the_current_mode():
    """The file mode mask is that of the process when it starts a worker, not that of the first worker."""
    carried_out(("a",))
    before = os.umask(0o27)
    try:
        assert carried_out(("mask",)) == [("0o27",)]
    finally:
        os.umask(before)


@linux
@pytest.mark.parametrize("name", ["reports", "tuning"])
def test_a_script_in_the_working_folder_is_not_taken_for_a_package(tmp_path: Path, name: str):
    """A user's file with the name of one of our packages is neither run nor a problem."""
    (tmp_path / f"{name}.py").write_text("raise SystemError('run')")
    script = tmp_path / "elsewhere" / "main.py"
    script.parent.mkdir()
    root, here = Path(__file__).parents[3], Path(__file__).parent
    script.write_text(
        f"import sys\nsys.path[1:1] = [{str(root)!r}, {str(here)!r}]\nfrom test_workers import carried_out\n"
        "if __name__ == '__main__':\n    print(carried_out(('a', 'b')))\n"
    )
    command = [sys.executable, str(script)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert (done.stdout.strip(), done.stderr) == ("[('a', 'b')]", "")


@linux
def test_without_a_server_workers_start_directly(monkeypatch: pytest.MonkeyPatch):
    """A server that dies at its start prevents no worker."""

    def died() -> None:
        raise EOFError("unexpected EOF")

    monkeypatch.setattr("multiprocessing.forkserver.ensure_running", died)
    assert sorted(carried_out(("a",), ("b",))) == [("a",), ("b",)]


@posix
def test_workers_are_started_where_temporary_files_have_long_names(tmp_path: Path):
    """The name of a socket has at most about a hundred letters; a longer folder of temporary files prevents no
    worker.
    """
    far = tmp_path / ("a" * 100)
    far.mkdir()
    code = "from tests.analyzer.night.test_workers import carried_out; print(carried_out(('a', 'b')))"
    env = os.environ | {"TMPDIR": str(far)}
    done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, timeout=120)
    assert done.stdout.strip() == "[('a', 'b')]", done.stderr


@pytest.mark.parametrize(
    ("line", "limits", "least"),
    [
        ("0::/system.slice/triage.service", {"system.slice/triage.service/memory.max": "500000000"}, 5e8),
        ("0::/system.slice/triage.service", {"system.slice/memory.max": "400000000"}, 4e8),
        ("0::/", {"memory.max": "300000000"}, 3e8),
        ("9:memory:/docker/x\n4:cpu:/y", {"memory/docker/x/memory.limit_in_bytes": "200000000"}, 2e8),
        ("9:memory:/docker/x", {"memory/memory.limit_in_bytes": "100000000"}, 1e8),
        ("0::/system.slice/triage.service", {"system.slice/triage.service/memory.max": "max"}, None),
        ("0::/", {}, None),
    ],
)
def test_the_limit_of_memory_is_that_of_its_own_group(tmp_path, line, limits, least):
    """Control groups of both versions, that of the process and those above it, limit the memory of the machine."""
    for name, text in limits.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text + "\n")
    (tmp_path / "own").write_text(line + "\n")
    whole = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    assert own_limits.machine_bytes(tmp_path, tmp_path / "own") == (least or whole)
