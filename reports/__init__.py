"""Pages in, text out: HTML, Markdown and charts. Imports none of the other packages."""
