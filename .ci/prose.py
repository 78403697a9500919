"""Plain English in pages, printed texts, docstrings and comments: python .ci/prose.py [FOLDER]

Prints one line for each banned phrase, each long sentence of a page and a README that is too long, and exits with 1
if there is one. Code blocks, inline code, links' addresses and figures are not read; of TOML files the values are.
"""

import ast
import io
import re
import sys
import tokenize
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

PAGES = (
    "README.md",
    "CONTRIBUTING.md",
    "CONVENTIONS.md",
    "docs/evidence/PROOF.md",
    "docs/*.md",
    "benchmarks/world/README.md",
)
GENERATED = {"columns.md"}
"""docs/columns.py writes it from analyzer/columns.toml."""

TEXTS = (
    "analyzer/columns.toml",
    "analyzer/pages/*.toml",
    "analyzer/words/*.toml",
    "identification/mismatch/words.toml",
    "tuning/reasons.toml",
    "*/limits.toml",
)
CODE = (
    "analyzer",
    "identification",
    "tuning",
    "reports",
    "tests",
    "proofs",
    "benchmarks",
    "sample_data",
    "docs",
)
"""Folders whose docstrings and comments are read."""
IDENTIFIER = "key"
"""The key of a TOML table whose value is not printed."""

SENTENCE_WORDS = 25
"""ASD-STE100 (Simplified Technical English) allows 25 in descriptions; code in back quotes is one word."""

README_WORDS = 900
"""Words of the README as `wc -w` counts them, its commands and its list included."""

SENTENCE_END = re.compile(r"(?<=[.!?])[)*]*\s+(?=[(*\"]*[A-Z\d])")
BANNED = {
    r"tells? apart|told apart": "distinguish",
    r"told|tells?|telling": "report, show, state",
    r"said": "reported, stated",
    r"asked|asks?": "require, test, query, use",
    r"hangs? on|hung on": "depend on",
    r"rests? on|rested on": "be based on, use",
    r"own(?:s|ed)? up to": "reported as unexplained",
    r"stands? for": "mean",
    r"stands?|stood": "be, be listed, be kept",
    r"speaks?|speaking": "show, support, concern",
    r"convict(?:s|ed)?": "identified as faulty",
    r"foretells?|foretold|foresees?|foresaw|foreseen": "predict",
    r"(?:as|kept) by a clock": "constant frequency",
    r"driven from outside|from outside": "external disturbance",
    r"plain (?:loop|simulation|lag|model)s?": "baseline model (FOPDT, ideal valve)",
    r"turns? of OP|on a turn": "OP reversal",
    r"leaves? over|left over|what is left": "residual",
    r"bears?|borne": "have, allow, support",
    r"of another hand|by another hand|a hand that": "independent generator",
    r"plays?": "backlash",
    r"(?<!square )waves?": "oscillation, waveform",
    r"cured|healthy|sound": "repaired, no fault found",
    r"chance of so much": "p-value",
    r"kin|look-alikes?|twins?|likeness": "indistinguishable effects, slow reference implementation",
    r"telltale|telling": "discriminating",
    r"priced?|prices": "penalty, cost",
    r"rivals?": "candidate",
    r"mended": "corrected, repaired",
    r"anew": "again",
    r"goes? on|going on|gone on": "continue",
    r"whole of": "all of",
    r"(?:rows?|samples?|moves?|files?|ms|words|sentences?) an? (?:cycle|loop|night|hour|day|sentence)": "per",
    r"beside": "next to, compared with, in addition to",
    r"whatever": "independently of",
    r"amid": "among",
    r"seeks?|sought": "search for",
}


def pages(root: Path) -> Iterator[tuple[Path, str]]:
    """The pages that are read and their texts; of CHANGELOG.md the newest of several sections."""
    for pattern in PAGES:
        for page in sorted(page for page in root.glob(pattern) if page.name not in GENERATED):
            yield page, page.read_text(encoding="utf-8")
    log = root / "CHANGELOG.md"
    sections = log.read_text(encoding="utf-8").split("\n## ") if log.exists() else []
    if len(sections) > 2:
        yield log, "\n## ".join(sections[:2])


def without_code(text: str) -> str:
    """A text of as many lines, without code blocks and comments; inline code is one word, a link is its text."""

    def lines(kept: str) -> "re._Repl":
        return lambda m: m.expand(kept) + "\n" * (m.group().count("\n") - m.expand(kept).count("\n"))

    text = re.sub(r"^```.*?^```|<!--.*?-->", lines(""), text, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"`[^`]+`", lines("Code"), text)
    return re.sub(r"!?\[([^\]]*)\]\([^)]*\)", lines(r"\1"), text)


def blocks(text: str) -> Iterator[tuple[int, str]]:
    """First line and text of each paragraph, list item, heading and cell of a table."""
    start, held = 1, ""
    for number, line in enumerate([*without_code(text).splitlines(), ""], 1):
        alone = line.startswith(("|", "#"))
        if alone or not line.strip() or re.match(r"\s*(?:[-*]|\d+\.)\s", line):
            yield start, held
            start, held = number + (not line.strip()), ""
        if alone:
            yield from ((number, cell) for cell in line.strip("|# ").split("|"))
            start = number + 1
        elif line.strip():
            held += f"{line}\n"


def banned(text: str) -> Iterator[tuple[int, str]]:
    """Position and report of each banned phrase of a text."""
    for pattern, instead in BANNED.items():
        for found in re.finditer(rf"\b(?:{pattern})\b", text, re.IGNORECASE):
            yield found.start(), f"'{found.group()}'; write: {instead}"


def findings(text: str) -> Iterator[tuple[int, str]]:
    """Line and report of each banned phrase and of each long sentence of a page."""
    for start, block in blocks(text):
        for position, what in banned(block.replace("\n", " ")):
            yield start + block.count("\n", 0, position), what
        at = 0
        for end in (*(m.end() for m in SENTENCE_END.finditer(block)), len(block)):
            words = [word for word in block[at:end].split() if re.search(r"\w", word)]
            if len(words) > SENTENCE_WORDS:
                limit = f"{len(words)} words; at most {SENTENCE_WORDS}"
                yield start + block.count("\n", 0, at), f"a sentence of {limit}: {' '.join(words[:6])} ..."
            at = end


def values(part: Any, name: str = "") -> Iterator[tuple[str, str]]:
    """Dotted name and text of each string in the values of a TOML file."""
    if isinstance(part, str):
        yield name, " ".join(part.split())
    elif isinstance(part, dict | list):
        for key, value in part.items() if isinstance(part, dict) else enumerate(part):
            if key != IDENTIFIER:
                yield from values(value, f"{name}.{key}".strip("."))


def printed(root: Path) -> Iterator[str]:
    """A line for each banned phrase in the texts that the program prints."""
    for pattern in TEXTS:
        for file in sorted(root.glob(pattern)):
            for name, text in values(tomllib.loads(file.read_text(encoding="utf-8"))):
                yield from (f"{file.relative_to(root)}: {name}: {what}" for _, what in banned(text))


def documented(file: Path) -> Iterator[tuple[int, str]]:
    """First line and text of each docstring and comment of a Python file; a string below a constant is one too."""
    text = file.read_text(encoding="utf-8")
    for node in ast.walk(ast.parse(text)):
        if (
            isinstance(node, ast.Expr)
            and isinstance(node.value, ast.Constant)
            and isinstance(node.value.value, str)
        ):
            yield node.lineno, node.value.value
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string


def explained(root: Path) -> Iterator[str]:
    """A line for each banned phrase in docstrings and comments."""
    for file in sorted(file for folder in CODE for file in (root / folder).rglob("*.py")):
        for start, text in documented(file):
            plain = without_code(text)
            for position, what in banned(plain.replace("\n", " ")):
                yield f"{file.relative_to(root)}:{start + plain.count(chr(10), 0, position)}: {what}"


def main(root: Path) -> int:
    """Print the findings of all pages and texts; 1 if there are any."""
    lines = [
        f"{page.relative_to(root)}:{line}: {what}"
        for page, text in pages(root)
        for line, what in sorted(findings(text))
    ]
    words = len((root / "README.md").read_text(encoding="utf-8").split())
    if words > README_WORDS:
        lines.append(f"README.md:1: {words} words; at most {README_WORDS}")
    lines.extend(printed(root))
    lines.extend(explained(root))
    print("".join(f"{line}\n" for line in lines), end="")
    return int(bool(lines))


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1] if len(sys.argv) > 1 else ".")))
