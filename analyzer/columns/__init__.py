"""The columns of results, each declared once; rows, store, lists, pages and docs/columns.md come from here."""
