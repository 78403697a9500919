"""Changes of throughput: the residual load of a model is the load that OP compensates, for any noise model."""

from __future__ import annotations

import tempfile
from pathlib import Path

import pytest

from analyzer.config import Config
from analyzer.history.export import open_export
from analyzer.loop.advice.propose import tuning_model
from analyzer.loop.assess import assess
from analyzer.loop.identification.agreement import agreement
from analyzer.loop.identification.identified import load_of
from analyzer.loop.record.judged_stretch import controller_of
from analyzer.loop.record.quality import prepare
from benchmarks.world.__main__ import export, spec_of
from benchmarks.world.draw import drawn
from benchmarks.world.pairs import varied


@pytest.mark.parametrize("at", [0, 3])
def test_the_simulated_present_agrees_under_ramps_of_the_load(at: int) -> None:
    """A level and a lag with worn valves and three changes of throughput are simulated with their present settings.

    Their error and OP's travel are the recorded ones. An earlier version took the offset of a nearly integrating
    noise model for a load. That load was 27 and 65 % of PV's span, and OP stayed at its limit.
    """
    config, d = Config(), drawn(662, at + 1, ("backlash",))[at]
    spec = spec_of(d)
    with tempfile.TemporaryDirectory() as folder:
        files = export(Path(folder), {d.name: varied(d, "load ramps")})
        one = prepare(spec, open_export(files).read(spec.tags), config.quality)
    controller = controller_of(spec, one)
    assert controller is not None
    loop, fit, _ = tuning_model(assess(one, controller, config).verdict, controller, config.advice)
    found = agreement(loop, fit, load_of(fit, controller))
    assert found.error == pytest.approx(1.0, abs=0.15)
    assert found.op_travel == pytest.approx(1.0, abs=0.05)
    assert found.worst(config.advice) is None
