"""Locations of exports and stores: a directory, or shared storage with a URL (s3://, gs://, abfs:// ...).

A URL becomes a path object with the methods of pathlib (universal_pathlib over fsspec); credentials and endpoint come
from the sources of the storage's own library, such as AWS_ENDPOINT_URL.
"""

from __future__ import annotations

import atexit
import errno
import logging
import re
import secrets
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import Any, TypeVar, cast
from urllib.parse import unquote, urlsplit

from identification.errors import InputError, NotNowError

TRIES = 16
"""Number of attempts of a failing request to shared storage, with growing waits: two minutes where it
refuses, six where it accepts and never answers."""

URL = re.compile(r"[a-z][a-z0-9+.-]+://", re.IGNORECASE)
"""Beginning of a URL; a drive letter is no scheme."""
LIBRARIES = frozenset({"botocore", "aiobotocore", "aiohttp", "s3fs", "gcsfs", "adlfs", "azure", "google"})
"""Packages whose errors mean a refusal by shared storage."""
OPTIONS: Mapping[str, dict[str, Any]] = {
    scheme: {"config_kwargs": {"retries": {"max_attempts": 0}}} for scheme in ("s3", "s3a")
}
"""Options for kinds of storage: requests are repeated here, and not by the library below as well."""
PASSING = frozenset(
    getattr(errno, name)
    for name in ("EBUSY", "EIO", "EREMOTEIO", "EAGAIN", "EHOSTUNREACH", "ENETUNREACH", "EPIPE")
    if hasattr(errno, name)
)
"""Errors of storage libraries for a response such as 503."""
UNREACHED = frozenset(
    {"EndpointConnectionError", "ConnectTimeoutError", "ReadTimeoutError", "ConnectionClosedError"}
    | {"ClientConnectorError", "ServerDisconnectedError", "ClientPayloadError", "FSTimeoutError"}
)
"""Errors of storage that did not respond, by name: its packages may not be installed."""
AT_ONCE = 8
"""Simultaneous requests to shared storage."""
T = TypeVar("T")
NEEDED = "pip install 'loop-triage[remote]', and for other storage than s3 the fsspec package of that storage"


class OutageError(InputError):
    """Shared storage did not respond, or was busy, for minutes: it may respond later."""


def place(text: str) -> Path:
    """A path of this machine, or of shared storage if the text is a URL. Raises InputError for a URL of storage
    without an installed package."""
    if not URL.match(text):
        return Path(text)
    if urlsplit(text).scheme == "file":
        return Path(unquote(urlsplit(text).path))
    try:
        from upath import UPath

        found = UPath(text, **OPTIONS.get(urlsplit(text).scheme, {}))
        _ = found.fs
    except (ImportError, ValueError) as error:
        seen = f"{text}: this kind of storage is not supported"
        raise InputError(seen, "the extra 'remote'", NEEDED) from error
    enable_retries(cast(Path, found))
    return cast(Path, found)


def enable_retries(path: Path) -> None:
    """Let this process repeat requests to shared storage, with growing delays, if it fails temporarily; no effect for
    a local path. A worker calls this before it reads or writes."""
    if not is_remote(path) or cast(Any, path).protocol not in ("s3", "s3a"):
        return
    import s3fs.core

    s3fs.core.S3FileSystem.retries = TRIES
    if hasattr(s3fs.core, "set_custom_error_handler"):
        s3fs.core.set_custom_error_handler(is_outage)
    logging.getLogger("asyncio").setLevel(logging.CRITICAL)  # of unfinished requests when a run ends


def is_remote(path: Path) -> bool:
    """Whether a path is one of shared storage."""
    return not isinstance(path, Path)


def refused(error: Exception) -> bool:
    """Whether an error is a refusal by shared storage: no credentials, no such bucket, no server at the endpoint."""
    return type(error).__module__.split(".")[0] in LIBRARIES


def is_passing(error: BaseException) -> bool:
    """Whether an error says nothing about the contents of a file: an error of the system or storage, or of memory."""
    if isinstance(error, IsADirectoryError | NotADirectoryError):
        return False
    if type(error) is OSError and error.errno is None:  # raised by Parquet for a file's contents
        return False
    return isinstance(error, MemoryError | OSError) or (isinstance(error, Exception) and refused(error))


def is_outage(error: BaseException | None) -> bool:
    """Whether an error, or its cause, is a temporary one of shared storage: it is busy, failed or unreachable. A
    refusal, for a missing right or object, is permanent."""
    if error is None or isinstance(error, PermissionError | FileNotFoundError | FileExistsError):
        return False
    if isinstance(error, OutageError) or type(error).__name__ in UNREACHED:
        return True
    if isinstance(error, OSError):
        passing = isinstance(error, TimeoutError | ConnectionError) or error.errno in PASSING
        return passing or is_outage(error.__cause__)
    answer = getattr(error, "response", None)
    if isinstance(answer, Mapping):
        return int(answer.get("ResponseMetadata", {}).get("HTTPStatusCode", 0)) >= 500
    return is_outage(error.__cause__)


def not_now(path: Path, error: BaseException) -> NotNowError:
    """Error for a file that cannot be read now, and is not known to be damaged."""
    why = " ".join(str(error).split())[:200] or type(error).__name__
    do = "look at endpoint and credentials" if is_remote(path) else "make it readable"
    return NotNowError(
        f"{path}: cannot be read now ({why}), and nothing was changed; {do}, then give the same command again, a run "
        "with --resume"
    )


def remove_tree(path: Path) -> None:
    """Delete a directory and its contents as far as possible; no effect if there is none."""
    if not is_remote(path):
        shutil.rmtree(path, ignore_errors=True)
        return
    remote: Any = path
    if remote.exists():
        remote.fs.rm(remote.path, recursive=True)


def each(function: Callable[..., T], paths: Sequence[Path], *others: Iterable[Any]) -> list[T]:
    """Results of a function for each of some paths, and for further arguments; in parallel for shared storage, which
    answers many requests as fast as one. The first error is raised."""
    if len(paths) < 2 or not is_remote(paths[0]):
        return list(map(function, paths, *others))
    with ThreadPoolExecutor(AT_ONCE) as pool:
        return list(pool.map(function, paths, *others))


def afresh(path: Path) -> Path:
    """A path without cached information, because other processes also write to shared storage."""
    if is_remote(path):
        remote: Any = path
        remote.fs.invalidate_cache(remote.path)
    return path


def content(path: Path) -> bytes:
    """The present contents of a small file.

    An object of shared storage is read in one request, because it may be rewritten meanwhile. Raises
    FileNotFoundError if there is none.
    """
    if not is_remote(path):
        return path.read_bytes()
    remote: Any = afresh(path)
    return bytes(remote.fs.cat_file(remote.path))


def is_whole(path: Path) -> bool:
    """Whether shared storage returns a complete object: twice the same bytes, as many as stated."""
    remote: Any = path
    try:
        held, again = content(path), content(path)
        return held == again and len(held) == int(remote.fs.info(remote.path)["size"])
    except Exception as error:
        if not is_passing(error):
            raise
        return False


def local_copies(paths: Sequence[Path], into: Path) -> tuple[list[Path], dict[Path, str]]:
    """Local paths, and the URL from which each file among them was copied into a directory, each with its own name.
    Raises InputError if there is nothing at a URL."""
    found: list[Path] = []
    origins: dict[Path, str] = {}
    for path in paths:
        if not is_remote(path):
            found.append(path)
            continue
        folder = into / f"fetched-{secrets.token_hex(8)}"
        copied = folder / (path.name or "export")
        found.append(copied)
        with refusals_as_errors(path):
            for url, local in _files(path, copied):
                _copy(url, local)
                origins[local] = str(url)
    return found, origins


@contextmanager
def refusals_as_errors(url: Path) -> Iterator[None]:
    """Convert a refusal of shared storage to one line with the URL. Raises InputError if it refuses, or no server
    responds."""
    try:
        yield
    except Exception as error:
        if not (isinstance(error, OSError) or refused(error)):
            raise
        why = " ".join(str(error).split())[:200] or type(error).__name__
        if is_outage(error):
            raise OutageError(f"{url}: {why}", "a storage that responds", "try again later") from error
        wanted = "an object, a bucket and credentials that the storage knows"
        raise InputError(f"{url}: {why}", wanted, "check URL, endpoint and credentials") from error


def _files(path: Path, copied: Path) -> list[tuple[Path, Path]]:
    """The files at a URL, itself or those under it, and their destinations."""
    if path.is_file():
        return [(path, copied)]
    root = str(path).rstrip("/") + "/"
    found = [(p, copied / PurePosixPath(str(p).removeprefix(root))) for p in path.rglob("*") if p.is_file()]
    if not found:
        raise InputError(f"{path}: nothing there", "a file or a folder of exports", "correct the URL")
    for url, local in found:  # names of objects may be invalid for files, or point outside the copies
        if not local.resolve().is_relative_to(copied.resolve()):
            seen = f"{url}: a name that leads out of its folder"
            raise InputError(seen, "names without ..", "rename the object")
    return found


def _copy(url: Path, local: Path) -> None:
    """Copy one file, completely or not at all, in one state of the object."""
    before = _state(url)
    local.parent.mkdir(parents=True, exist_ok=True)
    begun = local.with_name(f".{local.name}.{secrets.token_hex(8)}.tmp")
    try:
        with url.open("rb") as source, begun.open("xb") as target:
            shutil.copyfileobj(source, target, 1 << 22)
        if _state(url) != before:
            seen = f"{url}: was written to while it was read"
            raise InputError(seen, "an export that stays as it is", "run it when the historian has finished")
        begun.replace(local)
    finally:
        begun.unlink(missing_ok=True)


def _state(url: Any) -> tuple[object, ...]:
    """Identification of a state of an object."""
    known = afresh(url).fs.info(url.path)  # type: ignore[attr-defined]
    return tuple(
        str(known.get(name)) for name in ("size", "ETag", "etag", "LastModified", "mtime", "generation")
    )


def fetch_missing(path: Path, origins: Mapping[Path, str]) -> None:
    """Copy a file missing on this machine: a worker of a cluster has none of the copies made elsewhere."""
    if path in origins and not path.exists():
        folder = path.parent
        _copy(place(origins[path]), path)
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
