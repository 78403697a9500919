"""The prose check finds every banned phrase and long sentence, and nothing else."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

CHECK = Path(__file__).resolve().parents[2] / ".ci" / "prose.py"
PLAIN = """# A page

The valve has a backlash of 3 %.
The loop oscillates, and `the period is told` by the [list](plain-loop-told.md).

```sh
echo the plain loop is told
```

| column | holds |
|---|--:|
| error | 3.1 |
"""


def checked(folder: Path) -> subprocess.CompletedProcess[str]:
    """The prose check, run on the pages of a folder."""
    return subprocess.run(
        [sys.executable, str(CHECK), str(folder)], capture_output=True, text=True, check=False
    )


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (PLAIN, []),
        ("# A page\n\nThe fault of a loop hangs\non another loop.\n", ["3: 'hangs on'"]),
        ("| valve | at a turn of OP |\n", ["1: 'turn of OP'"]),
        ("- One.\n- Two " + "and two " * 15 + "are many.\n", ["2: a sentence of 33 words"]),
        ("Short. " * 901, ["1: 901 words"]),
    ],
    ids=["plain", "phrase", "cell", "sentence", "length"],
)
def test_prose_is_checked(text: str, found: list[str], tmp_path: Path) -> None:
    """The check finds a banned phrase (also across two lines), a long sentence and a long README, each with its
    line. It does not read code, and a plain text has no finding."""
    (tmp_path / "README.md").write_text(text, encoding="utf-8")
    done = checked(tmp_path)
    lines = done.stdout.splitlines()
    assert done.returncode == bool(found), done.stderr
    assert len(lines) == len(found)
    assert all(line.startswith(f"README.md:{part}") for line, part in zip(lines, found, strict=True)), lines


def test_the_newest_changes_are_checked(tmp_path: Path) -> None:
    """The check reads the newer of two versions in CHANGELOG. It does not read the older version, and it does
    not read a single version."""
    (tmp_path / "README.md").write_text(PLAIN, encoding="utf-8")
    log, old = tmp_path / "CHANGELOG.md", "## 0.1\n\nThe valve is told.\n"
    for text, status in (
        (f"# Changes\n\n{old}", 0),
        (f"# Changes\n\n## 0.2\n\nNothing.\n\n{old}", 0),
        (f"# Changes\n\n{old}\n{old}", 1),
    ):
        log.write_text(text, encoding="utf-8")
        assert checked(tmp_path).returncode == status


def test_printed_texts_are_checked(tmp_path: Path) -> None:
    """The check finds a banned phrase in a value of a TOML file, also across two lines, and reports the value's
    name. It does not read keys and comments."""
    (tmp_path / "README.md").write_text(PLAIN, encoding="utf-8")
    (tmp_path / "tuning").mkdir()
    for file, text, found in (
        ("reasons.toml", '# What is told.\n[told]\nplay = "Valve backlash."\n', []),
        (
            "reasons.toml",
            '[valve]\nsize = """The cause hangs \\\n    on it."""\n',
            ["valve.size: 'hangs on'"],
        ),
        (
            "limits.toml",
            '[gain.least]\nrange = [1, 2]\nmeaning = "Left over"\n',
            ["gain.least.meaning: 'Left over'"],
        ),
        ("limits.toml", '[[column]]\nkey = "told"\ntitle = "It is told"\n', ["column.0.title: 'told'"]),
    ):
        (tmp_path / "tuning" / file).write_text(text, encoding="utf-8")
        lines = checked(tmp_path).stdout.splitlines()
        assert len(lines) == len(found), lines
        assert all(
            line.startswith(f"tuning/{file}: {part}") for line, part in zip(lines, found, strict=True)
        ), lines
        (tmp_path / "tuning" / file).unlink()


def test_docstrings_and_comments_are_checked(tmp_path: Path) -> None:
    """A banned phrase in a docstring, in a string below a constant and in a comment is found with its line; names,
    other strings and code in back quotes are not read."""
    (tmp_path / "README.md").write_text(PLAIN, encoding="utf-8")
    (tmp_path / "tuning").mkdir()
    code = (
        '"""A fault\n\nhangs on another."""\n\ntold = "It is told."\n"""It is told."""\nLIMIT = 1  # left over\n'
        'def tell(said):\n    """`said` is a name."""\n'
    )
    (tmp_path / "tuning" / "some.py").write_text(code, encoding="utf-8")
    found = [line.split(";")[0] for line in checked(tmp_path).stdout.splitlines()]
    assert found == [
        "tuning/some.py:3: 'hangs on'",
        "tuning/some.py:6: 'told'",
        "tuning/some.py:7: 'left over'",
    ]
