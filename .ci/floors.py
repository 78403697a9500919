"""The oldest versions that a pyproject.toml allows, as pip's constraints: python .ci/floors.py pyproject.toml

Of what users install: the dependencies, and the extras except the tools of tests and pages.
"""

import re
import sys
import tomllib
from pathlib import Path


def floors(text: str) -> list[str]:
    """`numpy>=1.26` as `numpy==1.26`, each package once."""
    project = tomllib.loads(text)["project"]
    tools = {"test", "docs"}
    extras = (needs for name, needs in project["optional-dependencies"].items() if name not in tools)
    wanted = [*project["dependencies"], *(need for needs in extras for need in needs)]
    return [
        f"{name}=={least}"
        for name, least in (re.fullmatch(r"([\w-]+)>=([\d.]+)", w).groups() for w in wanted)
    ]


if __name__ == "__main__":
    print("\n".join(floors(Path(sys.argv[1]).read_text(encoding="utf-8"))))
