"""What a loop is, how it behaves, how it is found from its trends. Imports none of the other packages."""

import hashlib
import os
import shutil
from pathlib import Path

KERNELS = "NUMBA_CACHE_DIR"
"""Where numba keeps compiled kernels."""


def _keep_kernels_by_source() -> None:
    """Keep the compiled kernels of each state of these sources, and of their limits, apart.

    numba keeps a kernel until its own file changes, though another kernel that it calls may have changed or gone:
    after an update in place every loop would fail, or be told by old code.
    """
    here = Path(__file__).parent
    sources = [*sorted(here.rglob("*.py")), here / "limits.toml"]
    stats = [(str(p.relative_to(here)), p.stat()) for p in sources]
    stamps = [(name, s.st_mtime_ns, s.st_size) for name, s in stats]
    kept = here / "__pycache__" / f"kernels-{hashlib.sha256(repr(stamps).encode()).hexdigest()[:12]}"
    os.environ[KERNELS] = str(kept)
    if not kept.exists():
        for old in kept.parent.glob("kernels-*"):
            shutil.rmtree(old, ignore_errors=True)


if KERNELS not in os.environ:
    _keep_kernels_by_source()
