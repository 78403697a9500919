"""Two neighbouring heaters, each moved by hand in a random binary sequence while the room temperature drifts.

The neighbour is named, not the room.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from analyzer import api

STEP_S, HOURS = 4.0, 3.0
MASS, HEAT, AREA, BETWEEN = 0.004, 500.0, 1e-3, 2e-4
"""Mass [kg], heat capacity [J/(kg K)], surface to the room and between the heaters [m2]."""
ROOM, EXCHANGE = 10.0, 24.0
"""Coefficients of heat transfer to the room and between the heaters [W/(m2 K)], including radiation."""
POWER = np.array([0.01, 0.0075])
"""Power of each heater [W/%]."""


def binary(rng: np.random.Generator, n: int, low: float, high: float) -> np.ndarray:
    """A random binary sequence held for 2 to 15 min, shape (n,) [%]."""
    lengths = rng.uniform(120.0, 900.0, 200) / STEP_S
    return np.repeat(rng.choice([low, high], lengths.size), lengths.astype(int))[:n]


def two_heaters(seed: int, drift: float) -> pd.DataFrame:
    """Trends of both heaters: lumped energy balances with a sensor lag of 18 s; the room drifts [K]."""
    rng, n = np.random.default_rng(seed), int(HOURS * 3600 / STEP_S)
    op = np.array([binary(rng, n, 20.0, 60.0), binary(rng, n, 10.0, 50.0)])
    room = 23.0 + drift * np.sin(2 * np.pi * 0.8 * np.arange(n) / n + rng.uniform(0, 6))
    hot, seen, pv = np.array([37.0, 32.0]), np.array([37.0, 32.0]), np.empty((2, n))
    for k in range(n):
        for _ in range(4):
            flow = ROOM * AREA * (room[k] - hot) + EXCHANGE * BETWEEN * (hot[::-1] - hot) + POWER * op[:, k]
            hot = hot + STEP_S / 4 * flow / (MASS * HEAT)
            seen = seen + STEP_S / 4 * (hot - seen) / 18.0
        pv[:, k] = seen + rng.normal(0.0, 0.12, 2)
    stamp = pd.Timestamp("2026-03-02") + pd.to_timedelta(STEP_S * np.arange(n), unit="s")
    columns = {f"H{i + 1}.{r}": x[i].round(2) for i in (0, 1) for r, x in (("PV", pv), ("OP", op))}
    return pd.DataFrame({"timestamp": stamp, **columns})


@pytest.mark.parametrize("drift", [pytest.param(0.0, marks=pytest.mark.slow), 0.4])
def test_the_recorded_neighbour_is_named_and_not_the_room(drift: float, tmp_path: Path) -> None:
    """PV of the first heater also follows the OP of the second: that coupling is named with its gain.

    It explains most of the residual of the baseline model.
    """
    two_heaters(5, drift).to_csv(tmp_path / "export.csv", index=False)
    (tmp_path / "loops.csv").write_text(
        "loop,type,pv_lo,pv_hi\nH1,temperature,0,100\nH2,temperature,0,100\n", "utf-8"
    )
    found = api.explain(api.read(tmp_path / "export.csv", loops=tmp_path / "loops.csv").loop("H1")).data
    first = found["effects"][0]
    assert found["verdict"] == "coupling"
    assert first["held_out_share"] > 0.8
    own, across = ROOM * AREA, EXCHANGE * BETWEEN
    ratio = POWER[1] / POWER[0] * across / (own + across)  # of both static gains, from the energy balances
    assert first["parameters"]["coupling_gain"]["value"] == pytest.approx(ratio, rel=0.15)
