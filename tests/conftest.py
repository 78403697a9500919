"""Settings that all tests share."""

from hypothesis import settings

settings.register_profile("kernels", deadline=None)
settings.load_profile("kernels")
"""The first call of a kernel may compile it, which takes longer than any deadline of a test."""
