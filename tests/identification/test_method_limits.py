"""Each number of a method, a constant of the module that uses it, is read."""

from __future__ import annotations

import ast
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("identification", "tuning", "analyzer", "reports")


def stored(tree: ast.Module) -> set[str]:
    """Names in capital letters that a module sets at its top level."""
    sets = [n.targets for n in tree.body if isinstance(n, ast.Assign)]
    sets += [[n.target] for n in tree.body if isinstance(n, ast.AnnAssign)]
    names = {n.id for targets in sets for t in targets for n in ast.walk(t) if isinstance(n, ast.Name)}
    return {name for name in names if name.isupper()}


def loaded(tree: ast.Module) -> Counter[str]:
    """Names that a module reads, as names, attributes or imports."""
    nodes = list(ast.walk(tree))
    names = [n.id for n in nodes if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)]
    names += [n.attr for n in nodes if isinstance(n, ast.Attribute)]
    return Counter(names + [a.name for n in nodes if isinstance(n, ast.ImportFrom) for a in n.names])


def test_every_constant_of_a_module_is_read():
    """Every constant of a module is read by a line of the packages."""
    trees = {
        f: ast.parse(f.read_text("utf-8")) for part in PACKAGES for f in sorted((ROOT / part).rglob("*.py"))
    }
    read = sum((loaded(tree) for tree in trees.values()), Counter[str]())
    unread = [f"{f.relative_to(ROOT)}: {n}" for f, tree in trees.items() for n in stored(tree) if not read[n]]
    assert unread == []
