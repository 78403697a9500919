"""Print the documentation of the columns: `python -m analyzer.columns > docs/columns.md`."""

from analyzer.columns.page import document

print(document(), end="")
