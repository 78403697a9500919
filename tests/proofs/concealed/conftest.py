"""Small sealed sets that the tests share."""

import pytest

from proofs.concealed import make, plan, scene


@pytest.fixture(scope="session")
def short():
    """Recordings that are short enough for tests."""
    usual, scene.SCANS = scene.SCANS, (2500, 5000)
    yield
    scene.SCANS = usual


@pytest.fixture(scope="session")
def sealed(tmp_path_factory, short):
    """Six small cases: two without an effect, three with a single effect, one with a pair of effects."""
    out = tmp_path_factory.mktemp("cases")
    hidden = [(("backlash", "plain"),), (("second-lag", "concealed"),), (("controller-settings", "plain"),)]
    hidden.append((("nonlinear-gain", "plain"), ("load-step", "masked")))
    cases = [plan.Case(f"L{i:04d}", h, "", 11 + i) for i, h in enumerate(hidden)]
    cases += [plan.Case(f"L{4 + i:04d}", (), o, 70 + i) for i, o in enumerate(("gaps", "outlier"))]
    make.write(out, [make.seal(out, [], c) for c in cases])
    return out
