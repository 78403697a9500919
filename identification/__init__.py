"""Loop models, their simulation, and their identification from trends. Imports none of the other packages."""

import atexit
import contextlib
import hashlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

KERNELS = "NUMBA_CACHE_DIR"
"""Environment variable for numba's folder of compiled kernels."""


def _name_of_kernels() -> str:
    """The folder for the kernels of this state of the sources and of their limits.

    numba keeps a kernel until its own file changes, although another kernel that it calls may have changed or been
    removed: after an update in place every loop would fail, or be analysed by old code.
    """
    here = Path(__file__).parent
    sources = [*sorted(here.rglob("*.py")), here / "limits.toml"]
    stats = [(str(p.relative_to(here)), p.stat()) for p in sources]
    stamps = [(name, s.st_mtime_ns, s.st_size) for name, s in stats]
    return f"kernels-{hashlib.sha256(repr(stamps).encode()).hexdigest()[:12]}"


def _cache_folders() -> Iterator[Path]:
    """Possible folders for kernels, best first: as configured, next to the code, and the cache folder of a
    service or user."""
    if stated := os.environ.get(KERNELS):
        yield Path(stated).parent if Path(stated).name.startswith("kernels-") else Path(stated)
    yield Path(__file__).parent / "__pycache__"
    if service := os.environ.get("CACHE_DIRECTORY"):  # systemd
        yield Path(service.split(":")[0])
    with contextlib.suppress(RuntimeError):  # no home
        yield Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "loop-triage"


def _is_writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


def _set_kernel_cache() -> None:
    """Give numba a writable folder: without one, the import of a kernel is an error.

    The folder is next to the code or elsewhere; the last choice is a temporary folder of this process.
    Kernels
    compiled at installation are copied there. If no folder can be made, kernels are compiled and not kept.
    """
    name, own_cache = _name_of_kernels(), Path(__file__).parent / "__pycache__"
    place = next(filter(_is_writable, _cache_folders()), None)
    if place is None:
        try:
            place = Path(tempfile.mkdtemp(prefix="triage-kernels-"))
        except OSError:
            _disable_kernel_cache()
            return
        atexit.register(shutil.rmtree, place, True)
    kept = place / name
    os.environ[KERNELS] = str(kept)
    if kept.exists():
        return
    if place == own_cache:
        for old in own_cache.glob("kernels-*"):
            shutil.rmtree(old, ignore_errors=True)
    elif (own_cache / name).exists():
        with contextlib.suppress(OSError, shutil.Error):
            shutil.copytree(own_cache / name, kept)


def _disable_kernel_cache() -> None:
    from numba.core.dispatcher import Dispatcher

    os.environ.pop(KERNELS, None)
    Dispatcher.enable_caching = lambda _: None  # type: ignore


_set_kernel_cache()
