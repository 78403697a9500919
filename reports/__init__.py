"""Rendering of pages as text: HTML, Markdown and charts. Imports none of the other packages."""
