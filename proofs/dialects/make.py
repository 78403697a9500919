"""Write every case: `python -m proofs.dialects.make OUT` writes OUT/<case>/... and OUT/truth.json."""

import json
import shutil
import sys
from importlib import import_module
from pathlib import Path

from proofs.dialects.common import CASES

MODULES = [
    "pi",
    "historians",
    "historians2",
    "historians3",
    "siemens_rockwell",
    "recorders_it",
    "cloud",
    "generic",
    "generic_time",
    "generic_quality",
    "generic_files",
    "refuse",
]


def main(out):
    for name in MODULES:
        import_module(f"proofs.dialects.{name}")
    out.mkdir(parents=True, exist_ok=True)
    listing = []
    for c in CASES:
        folder = out / c.name
        if folder.exists():
            shutil.rmtree(folder)
        folder.mkdir()
        for name, body in c.files.items():
            (folder / name).write_bytes(body)
        entry = {
            "case": c.name,
            "family": c.family,
            "paths": [f"{c.name}/{name}" for name in c.files],
            "options": c.options,
            "kind": c.kind,
            "why": c.why,
            "tags": c.tags,
        }
        if c.aliases:
            entry["aliases"] = c.aliases
        if c.uncertain:
            entry["uncertain"] = c.uncertain
        listing.append(entry)
        for tag, d in c.tags.items():
            assert len(d["t"]) == len(d["v"]) >= 30, (c.name, tag, len(d["t"]))
    (out / "truth.json").write_text(json.dumps(listing, ensure_ascii=False, indent=0), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
