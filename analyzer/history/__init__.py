"""The readers of exports: they return raw stamps, values and quality."""
