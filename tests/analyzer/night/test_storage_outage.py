"""Shared storage that fails for a while: the run survives, or ends with one line and its own status, without
'damaged'.
"""

from __future__ import annotations

import http.client
import json
import os
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from analyzer import locations
from analyzer.cli import main
from analyzer.store import lock as store_lock
from analyzer.store.lock import OWNER, locked
from identification.errors import InputError
from proofs.plant import write_export
from tests.analyzer.night.test_batch import at_rest, tables
from tests.analyzer.night.test_shared_storage import bucket  # noqa: F401

s3fs = pytest.importorskip("s3fs", reason="the extra 'remote' is not installed")
BUSY = b'<?xml version="1.0"?><Error><Code>SlowDown</Code><Message>Please reduce your request rate.</Message></Error>'


class Disturbing(ThreadingHTTPServer):
    """A proxy before a storage whose `answer` (count of the request, method) may be a status, or None to pass it
    on.
    """

    daemon_threads = True

    def __init__(self, behind: str, answer: Callable[[int, str], int | None]) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.behind, self.answer, self.count = behind.removeprefix("http://"), answer, 0


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server: Disturbing

    def do_GET(self) -> None:
        self.server.count += 1
        body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
        status = self.server.answer(self.server.count, self.command)
        if status == 0:  # accept, and never respond
            time.sleep(3600.0)
        if status is not None:
            self._reply(status, BUSY, [("Content-Type", "application/xml")])
            return
        behind = http.client.HTTPConnection(self.server.behind)
        behind.request(self.command, self.path, body, dict(self.headers))
        got = behind.getresponse()
        self._reply(got.status, got.read(), got.getheaders())

    do_PUT = do_POST = do_DELETE = do_HEAD = do_GET  # noqa: N815

    def _reply(self, status: int, data: bytes, heads: list[tuple[str, str]]) -> None:
        self.send_response(status)
        known = dict(heads).get("Content-Length") if self.command == "HEAD" else None
        for name, value in heads:
            if name.lower() not in ("content-length", "transfer-encoding", "connection", "date", "server"):
                self.send_header(name, value)
        self.send_header("Content-Length", known or str(len(data)))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(data)

    def log_message(self, *_: Any) -> None:
        """Write no log."""


@contextmanager
def disturbed(answer: Callable[[int, str], int | None]) -> Iterator[Disturbing]:
    """A proxy instead of the storage."""
    with Disturbing(os.environ["AWS_ENDPOINT_URL"], answer) as proxy, pytest.MonkeyPatch.context() as patch:
        threading.Thread(target=proxy.serve_forever, daemon=True).start()
        patch.setenv("AWS_ENDPOINT_URL", f"http://127.0.0.1:{proxy.server_address[1]}")
        s3fs.S3FileSystem.clear_instance_cache()
        yield proxy
        proxy.shutdown()
    s3fs.S3FileSystem.clear_instance_cache()


@pytest.fixture(scope="module")
def export(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four loops that do not oscillate."""
    return write_export(
        tmp_path_factory.mktemp("outage") / "night.parquet", {f"L{k}": at_rest(k, 900) for k in range(4)}
    )


@pytest.fixture(autouse=True)
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let this test process assess the chunks, so that they use its endpoint."""
    from analyzer.night import batch

    of = batch.executor
    monkeypatch.setattr(batch, "executor", lambda jobs, *rest: of(0, *rest))


def ran(export: Path, store: str, *more: str) -> Result:
    """The batch."""
    return CliRunner().invoke(main, ["run", str(export), "--store", store, *more])


def kept(store: str, folder: Path) -> dict[str, list[dict[str, object]]]:
    """The tables of a store at a URL."""
    (copy,), _ = locations.local_copies([locations.place(store)], folder)
    return tables(copy)


def test_one_busy_response_in_five_changes_nothing(bucket: str, export: Path, tmp_path: Path) -> None:  # noqa: F811
    """If a storage responds with 503 to one of five requests, the store is the same as without errors."""
    assert ran(export, str(tmp_path / "store")).exit_code == 0
    store = f"{bucket}/busy"
    with disturbed(lambda count, _: 503 if count % 5 == 0 else None) as proxy:
        result = ran(export, store)
        assert proxy.count > 20
    assert result.exit_code == 0, result.output
    assert kept(store, tmp_path) == tables(tmp_path / "store")


@pytest.mark.parametrize("after", [0, 14, 30])
def test_an_outage_is_one_line_and_can_be_resumed(
    bucket: str,  # noqa: F811
    export: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    after: int,
) -> None:
    """A storage that fails from some request on ends the run with status 75 and one line with URL and --resume.

    Nothing is called damaged, and --resume gives the store of an undisturbed run.
    """
    monkeypatch.setattr(locations, "TRIES", 2)
    store = f"{bucket}/down-{after}"
    with disturbed(lambda count, _: 503 if count > after else None):
        result = ran(export, store)
    assert result.exit_code == 75, result.output
    last = result.stderr.splitlines()[-1]
    assert store in last
    assert "--resume" in last
    assert "damaged" not in result.stderr
    assert "Traceback" not in result.output
    monkeypatch.setattr(store_lock, "_is_dead_here", lambda known: known.get("process") == os.getpid())
    assert ran(export, store, "--resume").exit_code == 0
    assert ran(export, str(tmp_path / "store")).exit_code == 0
    assert kept(store, tmp_path) == tables(tmp_path / "store")


def test_a_storage_that_never_responds_ends_the_run(
    bucket: str,  # noqa: F811
    export: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """If requests are accepted without a response, the run ends with status 75 after its tries."""
    monkeypatch.setattr(locations, "TRIES", 1)
    monkeypatch.setattr(s3fs.S3FileSystem, "read_timeout", 1)
    with disturbed(lambda count, _: 0) as proxy:
        result = ran(export, f"{bucket}/silent")
    assert result.exit_code == 75, result.output
    assert 1 <= proxy.count <= 2  # each waits for its own time limit


def test_of_two_runs_at_one_moment_one_is_refused(bucket: str, monkeypatch: pytest.MonkeyPatch) -> None:  # noqa: F811
    """If two runs both find no signature, the storage creates one, and the other run is refused with the owner of the
    store.
    """
    store, found = locations.place(f"{bucket}/two"), threading.Barrier(2)
    look, first = store_lock._require_unsigned, threading.local()

    def both(path: Path) -> bool:
        dead = look(path)
        if not getattr(first, "met", False):
            first.met = True
            found.wait(timeout=20.0)
        return dead

    monkeypatch.setattr(store_lock, "_require_unsigned", both)
    outcomes: list[str] = []

    def hold() -> None:
        try:
            with locked(store):
                outcomes.append("held")
                time.sleep(1.0)
        except InputError as error:
            outcomes.append(error.seen)

    threads = [threading.Thread(target=hold) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert outcomes[0] == "held"
    assert "in use by process" in outcomes[1]
    assert not (store / OWNER).exists()


def test_a_signature_of_a_dead_process_is_ignored(bucket: str) -> None:  # noqa: F811
    """A signature of a process of this machine that has ended is ignored at any age.

    A signature of a running process or of another machine is not.
    """
    store = locations.place(f"{bucket}/dead")
    signed = {"host": socket.gethostname(), "process": 2**22 + 12345, "alive_s": time.time(), "mark": "x"}
    (store / OWNER).write_text(json.dumps(signed))
    with locked(store):
        pass
    for other in ({"process": os.getppid()}, {"host": "elsewhere"}):
        (store / OWNER).write_text(json.dumps({**signed, **other, "user": "x", "since": "now"}))
        with pytest.raises(InputError, match="in use by"), locked(store):
            pass
