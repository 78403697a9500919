"""What is told in sentences: results in, text out."""
