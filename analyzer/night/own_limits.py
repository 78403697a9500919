"""Limits that a worker process sets for itself: of memory, by the machine or its control groups, and of time."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path

MEGABYTE = 2**20


def limit_memory(megabytes: float, machine_share: float) -> None:
    """Make allocations fail above the present use plus so many megabytes, or plus a share of the machine's memory; no
    effect where the system does not support it."""
    if sys.platform != "linux":
        return
    import resource

    with contextlib.suppress(OSError, ValueError):
        most = min(_held_bytes() + int(megabytes * MEGABYTE), int(machine_share * machine_bytes()))
        _, hard = resource.getrlimit(resource.RLIMIT_DATA)
        limit = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(resource.RLIMIT_DATA, (limit, hard))


def machine_bytes(groups: Path = Path("/sys/fs/cgroup"), of: Path = Path("/proc/self/cgroup")) -> float:
    """Memory of this machine, or what the control groups of this process, of either version, allow [bytes]."""
    limits = [float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))]
    for folder, name in _groups_of(groups, of):
        for level in (folder, *folder.parents):
            if level.is_relative_to(groups):
                with contextlib.suppress(OSError, ValueError):  # none, or "max"
                    limits.append(float((level / name).read_text(encoding="ascii")))
    return min(limits)


def _groups_of(groups: Path, of: Path) -> Iterator[tuple[Path, str]]:
    """The folders of the control groups that limit memory, and the file of the limit there; a container has its own
    as the first."""
    yield groups, "memory.max"
    with contextlib.suppress(OSError):
        for line in of.read_text(encoding="utf-8").splitlines():
            kinds, _, path = line.partition(":")[2].partition(":")
            if kinds in ("", "memory"):
                old = "memory" in kinds
                inside = groups / "memory" if old else groups
                yield inside / path.lstrip("/"), "memory.limit_in_bytes" if old else "memory.max"
                yield inside, "memory.limit_in_bytes" if old else "memory.max"


def _held_bytes() -> int:
    """Memory of this process that counts towards RLIMIT_DATA [bytes]."""
    with open("/proc/self/status", encoding="ascii") as status:
        line = next(line for line in status if line.startswith("VmData:"))
    return int(line.split()[1]) * 1024


def limit_processor(seconds: float) -> None:
    """End this process after so many more seconds of processor time; no effect on systems without support."""
    if sys.platform == "win32":
        return
    import resource

    used = resource.getrusage(resource.RUSAGE_SELF)
    limit = int(used.ru_utime + used.ru_stime + seconds) + 1
    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    if hard == resource.RLIM_INFINITY or limit <= hard:
        resource.setrlimit(resource.RLIMIT_CPU, (limit, hard))
