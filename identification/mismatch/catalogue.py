"""The catalogue of left-out physics that open-loop rivals are made of."""

from __future__ import annotations

from identification.mismatch.load_rows import LOAD
from identification.mismatch.process_rows import PROCESS
from identification.mismatch.valve_rows import VALVE

CATALOGUE = (*VALVE, *PROCESS, *LOAD)
