"""The built site has the repository's folders, so that links between pages are the same in both.

mkdocs reads one folder. As a hook of mkdocs.yml this file gives it the pages of all folders and a page of limits.
As an extension of the API reference it marks the examples of docstrings as code.
"""

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import griffe
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

PATTERNS = (
    "*.md",
    "LICENSE",
    "*.png",
    "docs/**/*",
    "proofs/**/*.md",
    "proofs/*.png",
    "benchmarks/**/*.md",
    "sample_data/*.md",
)
CONFIG = [sys.executable, "-m", "analyzer.cli", "config"]
LIMITS = """# Limits

`triage config` prints all limits with unit, range, meaning and source. `--config FILE` of any command reads a file
with other values.

```toml
{}
```
"""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """The files of the theme, and the project's pages under their paths from the root."""
    root = Path(config.config_file_path).parent
    for file in [file for file in files if file.src_dir == config.docs_dir]:
        files.remove(file)
    found = {path for pattern in PATTERNS for path in root.glob(pattern) if path.is_file()}
    for path in sorted(path for path in found if path.suffix not in (".py", ".pyc")):
        uri = path.relative_to(root).as_posix()
        files.append(File(uri, str(root), config.site_dir, config.use_directory_urls))
    limits = subprocess.run(CONFIG, cwd=root, capture_output=True, text=True, check=True).stdout
    files.append(File.generated(config, "docs/limits.md", content=LIMITS.format(limits)))
    return files


class Examples(griffe.Extension):
    """The examples of a docstring as blocks of code."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Put fences around each example."""
        if obj.docstring is not None:
            examples = r"^>>> .*(?:\n.+)*"
            obj.docstring.value = re.sub(
                examples, r"\n```pycon\n\g<0>\n```\n", obj.docstring.value, flags=re.MULTILINE
            )
