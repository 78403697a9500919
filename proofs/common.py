"""What all proofs and benchmarks share: the options of a command, and the page that it writes next to its module."""

from __future__ import annotations

import argparse
import subprocess
from collections.abc import Iterable
from pathlib import Path
from typing import Any


def parser_of(about: str | None, **defaults: Any) -> argparse.ArgumentParser:
    """Options of a command, one for each default: a list takes several values, False is a flag; `folders` are
    paths."""
    made = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, default in defaults.items():
        if name == "folders":
            made.add_argument(name, nargs=default, type=Path)
        elif default is False:
            made.add_argument(f"--{name}", action="store_true")
        else:
            several = isinstance(default, list)
            kind = (
                type((default or [0])[0]) if several else Path if isinstance(default, Path) else type(default)
            )
            made.add_argument(f"--{name}", type=kind, default=default, nargs="+" if several else None)
    return made


def command_line(about: str | None, **defaults: Any) -> argparse.Namespace:
    """The options of the command line."""
    return parser_of(about, **defaults).parse_args()


def command(file: str, *places: str, **options: Any) -> str:
    """The command as the page shows it: `python -m proofs.NAME PLACE --OPTION VALUE`."""
    path = Path(file)
    words = ["python -m", f"{path.parent.name}.{path.stem}", *places]
    for name, value in options.items():
        several = value if isinstance(value, list) else [value]
        words += [f"--{name}", *(f"{v:g}" if isinstance(v, float) else str(v) for v in several)]
    return f"`{words[0]} {' '.join(words[1:])}`"


def table(heads: str, rows: Iterable[Iterable[object]], numbers: bool = False) -> str:
    """A Markdown table of heads separated by `|`; numbers: all columns but the first are right-aligned."""
    columns = heads.count("|") + 1
    rule = "|---" + ("|--:" if numbers else "|---") * (columns - 1) + "|"
    return "\n".join([f"| {heads} |", rule, *(f"| {' | '.join(map(str, cells))} |" for cells in rows)])


def _commit() -> list[str]:
    """The sentence that names the commit of the code; empty where git or its history is missing."""
    arguments = ["git", "describe", "--always", "--dirty=, changed since"]
    try:
        found = subprocess.run(
            arguments, cwd=Path(__file__).parent, capture_output=True, text=True, check=True
        )
    except (OSError, subprocess.CalledProcessError):
        return []
    return [f"Measured with the code of commit {found.stdout.strip()}."]


def publish(file: str | Path, title: str, *parts: str) -> None:
    """Write a page of these paragraphs next to the proof, or to a file of another name, and print it. The page names
    the commit of the code where git is available."""
    text = "\n\n".join([f"# {title}", *_commit(), *(p.rstrip() for p in parts)]) + "\n"
    Path(file).with_suffix(".md").write_text(text, encoding="utf-8")
    print(text)
