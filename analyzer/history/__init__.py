"""The only readers of exports: raw stamps, values and quality out."""
