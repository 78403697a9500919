"""Compiled kernels are kept by the state of all sources that they may come from."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
ASK = "import identification, os; print(os.environ['NUMBA_CACHE_DIR'])"


def kept(at: Path) -> str:
    """Where a copy of the package keeps its kernels."""
    env = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"} | {"PYTHONPATH": str(at)}
    done = subprocess.run([sys.executable, "-c", ASK], cwd=at, env=env, capture_output=True, text=True)
    return done.stdout.strip()


def test_kernels_of_old_sources_are_not_used(tmp_path: Path) -> None:
    """After any source or limit has changed or gone, kernels are kept elsewhere and the old ones are forgotten; else
    they stay where they were."""
    ours = tmp_path / "identification"
    shutil.copytree(ROOT / "identification", ours, ignore=shutil.ignore_patterns("__pycache__"))
    first = Path(kept(tmp_path))
    first.mkdir(parents=True)
    assert first.parent == ours / "__pycache__"
    assert Path(kept(tmp_path)) == first
    (ours / "models.py").write_text((ours / "models.py").read_text() + "\n# changed\n")
    second = Path(kept(tmp_path))
    assert second != first
    assert not first.exists()
    (ours / "limits.toml").write_text((ours / "limits.toml").read_text() + "\n# changed\n")
    third = Path(kept(tmp_path))
    assert third != second
    (ours / "errors.py").unlink()
    assert Path(kept(tmp_path)) not in (first, second, third)
