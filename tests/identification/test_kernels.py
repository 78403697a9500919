"""Compiled kernels are stored by the state of all their sources."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
SCRIPT = "import identification, os; print(os.environ['NUMBA_CACHE_DIR'])"


def kernel_folder(at: Path) -> str:
    """The folder in which a copy of the package stores its kernels."""
    env = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"} | {"PYTHONPATH": str(at)}
    done = subprocess.run([sys.executable, "-c", SCRIPT], cwd=at, env=env, capture_output=True, text=True)
    return done.stdout.strip()


def test_kernels_of_old_sources_are_not_used(tmp_path: Path) -> None:
    """After any change or removal of a source or a limit, kernels have another folder and the old ones are
    removed. Without a change the folder stays the same."""
    ours = tmp_path / "identification"
    shutil.copytree(ROOT / "identification", ours, ignore=shutil.ignore_patterns("__pycache__"))
    first = Path(kernel_folder(tmp_path))
    first.mkdir(parents=True)
    assert first.parent == ours / "__pycache__"
    assert Path(kernel_folder(tmp_path)) == first
    (ours / "models.py").write_text((ours / "models.py").read_text() + "\n# changed\n")
    second = Path(kernel_folder(tmp_path))
    assert second != first
    assert not first.exists()
    (ours / "limits.toml").write_text((ours / "limits.toml").read_text() + "\n# changed\n")
    third = Path(kernel_folder(tmp_path))
    assert third != second
    (ours / "errors.py").unlink()
    assert Path(kernel_folder(tmp_path)) not in (first, second, third)
