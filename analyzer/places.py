"""Where exports and stores lie: in a directory, or on shared storage that a URL names (s3://, gs://, abfs:// ...).

A URL becomes a path object with the methods of pathlib (universal_pathlib over fsspec); credentials and endpoint come
from where the storage's own library looks for them, such as AWS_ENDPOINT_URL.
"""

from __future__ import annotations

import atexit
import re
import secrets
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import Any, cast
from urllib.parse import unquote, urlsplit

from identification.errors import InputError, NotNowError

URL = re.compile(r"[a-z][a-z0-9+.-]+://", re.IGNORECASE)
"""How a URL begins; a drive letter is no scheme."""
LIBRARIES = frozenset({"botocore", "aiobotocore", "aiohttp", "s3fs", "gcsfs", "adlfs", "azure", "google"})
"""Packages whose errors say what shared storage refuses."""
NEEDED = "pip install 'loop-triage[remote]', and for other storage than s3 the fsspec package of that storage"


def place(text: str) -> Path:
    """A path of this machine, or of shared storage where the text is a URL. Raises InputError for a URL of storage
    for which no package is installed."""
    if not URL.match(text):
        return Path(text)
    if urlsplit(text).scheme == "file":
        return Path(unquote(urlsplit(text).path))
    try:
        from upath import UPath

        found = UPath(text)
        _ = found.fs
    except (ImportError, ValueError) as error:
        raise InputError(f"{text}: no storage of that kind here", "the extra 'remote'", NEEDED) from error
    return cast(Path, found)


def is_remote(path: Path) -> bool:
    """Whether a path is one of shared storage."""
    return not isinstance(path, Path)


def refused(error: Exception) -> bool:
    """Whether an error is one of shared storage: no credentials, no such bucket, nobody at the endpoint."""
    return type(error).__module__.split(".")[0] in LIBRARIES


def is_passing(error: BaseException) -> bool:
    """Whether an error says nothing of what a file holds: system or storage did not hand it out, or memory ended."""
    if isinstance(error, IsADirectoryError | NotADirectoryError):
        return False
    if type(error) is OSError and error.errno is None:  # what Parquet finds wrong with a file
        return False
    return isinstance(error, MemoryError | OSError) or (isinstance(error, Exception) and refused(error))


def not_now(path: Path, error: BaseException) -> NotNowError:
    """What is said of a file that cannot be read at this time, and is not known to be damaged."""
    why = " ".join(str(error).split())[:200] or type(error).__name__
    said = "nothing says that it is damaged, and nothing was changed"
    return NotNowError(
        f"{path}: cannot be read now ({why}); {said}; make it readable, then give the same command again, a run "
        "with --resume"
    )


def remove_tree(path: Path) -> None:
    """Delete a directory and all in it, as far as that can be done; nothing where there is none."""
    if not is_remote(path):
        shutil.rmtree(path, ignore_errors=True)
        return
    remote: Any = path
    if remote.exists():
        remote.fs.rm(remote.path, recursive=True)


def content(path: Path) -> bytes:
    """What a small file holds now.

    One of shared storage is asked for in one request: it may be written anew while it is read. Raises
    FileNotFoundError where there is none.
    """
    if not is_remote(path):
        return path.read_bytes()
    remote: Any = path
    remote.fs.invalidate_cache(remote.path)
    return bytes(remote.fs.cat_file(remote.path))


def is_whole(path: Path) -> bool:
    """Whether shared storage hands out all of an object: twice the same bytes, as many as it states."""
    remote: Any = path
    try:
        held, again = content(path), content(path)
        return held == again and len(held) == int(remote.fs.info(remote.path)["size"])
    except Exception as error:
        if not is_passing(error):
            raise
        return False


def at_hand(paths: Sequence[Path], into: Path) -> tuple[list[Path], dict[Path, str]]:
    """Paths of this machine, and from which URL each file among them was copied into a directory, each with its own
    name. Raises InputError where there is nothing at a URL."""
    found: list[Path] = []
    origins: dict[Path, str] = {}
    for path in paths:
        if not is_remote(path):
            found.append(path)
            continue
        folder = into / f"fetched-{secrets.token_hex(8)}"
        copied = folder / (path.name or "export")
        found.append(copied)
        with answering(path):
            for url, local in _files(path, copied):
                _copy(url, local)
                origins[local] = str(url)
    return found, origins


@contextmanager
def answering(url: Path) -> Iterator[None]:
    """What shared storage refuses as one line with the URL that was asked for. Raises InputError where it refuses, or
    nobody answers there."""
    try:
        yield
    except Exception as error:
        if not (isinstance(error, OSError) or refused(error)):
            raise
        why = " ".join(str(error).split())[:200] or type(error).__name__
        wanted = "an object, a bucket and credentials that the storage knows"
        raise InputError(f"{url}: {why}", wanted, "check URL, endpoint and credentials") from error


def _files(path: Path, copied: Path) -> list[tuple[Path, Path]]:
    """The files at a URL, itself or those under it, and where each goes."""
    if path.is_file():
        return [(path, copied)]
    root = str(path).rstrip("/") + "/"
    found = [(p, copied / PurePosixPath(str(p).removeprefix(root))) for p in path.rglob("*") if p.is_file()]
    if not found:
        raise InputError(f"{path}: nothing there", "a file or a folder of exports", "correct the URL")
    for url, local in found:  # objects may be named as no file can be, or as one outside the copies
        if not local.resolve().is_relative_to(copied.resolve()):
            seen = f"{url}: a name that leads out of its folder"
            raise InputError(seen, "names without ..", "rename the object")
    return found


def _copy(url: Path, local: Path) -> None:
    """One file, whole or not at all."""
    local.parent.mkdir(parents=True, exist_ok=True)
    begun = local.with_name(f".{local.name}.{secrets.token_hex(8)}.tmp")
    try:
        with url.open("rb") as source, begun.open("xb") as target:
            shutil.copyfileobj(source, target, 1 << 22)
        begun.replace(local)
    finally:
        begun.unlink(missing_ok=True)


def bring(path: Path, origins: Mapping[Path, str]) -> None:
    """Copy a file anew that this machine has not: a worker of a cluster has none of what was copied elsewhere."""
    if path in origins and not path.exists():
        made = path.parent
        _copy(place(origins[path]), path)
        atexit.register(shutil.rmtree, made, ignore_errors=True)
