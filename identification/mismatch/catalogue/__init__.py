"""The catalogue of left-out physics that open-loop candidates are made of."""

from __future__ import annotations

from identification.mismatch.catalogue.load import LOAD
from identification.mismatch.catalogue.process import PROCESS
from identification.mismatch.catalogue.valve import VALVE

CATALOGUE = (*VALVE, *PROCESS, *LOAD)
