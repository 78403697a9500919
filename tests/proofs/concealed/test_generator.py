"""The sealed cases are correct: their grades, their seeds, and what each file contains and does not contain."""

import json
import math

import numpy as np
import pandas as pd
import pytest

from proofs.concealed import grade, make, plan, strange
from proofs.concealed.effects import CATALOGUE, NAMES, apply
from proofs.concealed.scene import draw_scene


def test_every_name_is_sealed():
    """A set of 400 cases has every effect at every level, and a third of the cases has no effect."""
    cases = plan.plan(400, 1)
    alone = [c.effects[0] for c in cases if len(c.effects) == 1 and c.effects[0][0] in CATALOGUE]
    assert {(n, lv) for n, lv in alone} == {(e.name, lv) for e in NAMES for lv in grade.LEVELS}
    assert sum(not c.effects for c in cases) == 133
    assert {c.oddity for c in cases if not c.effects} == set(strange.ODDITIES)
    assert sum(len(c.effects) == 2 for c in cases) == 32


def test_the_catalogue_has_thirty_names_in_six_blocks():
    """The catalogue has thirty names in six blocks: process 10, valve 7, load 4, and sensor, recorder and
    controller 3 each."""
    blocks = pd.Series([e.block for e in NAMES]).value_counts().to_dict()
    assert blocks == {
        "process": 10, "valve": 7, "load": 4, "sensor": 3, "recorder": 3, "controller": 3
    }  # fmt: skip


@pytest.mark.parametrize("name", [e.name for e in NAMES if not e.sizes and e.name != "coupling"])
def test_energy_grows_with_strength(name):
    """The residual energy of every graded effect grows with its strength, and is close to zero at the lowest
    strength."""
    effect = CATALOGUE[name]
    kind = "level" if "level" in effect.kinds and effect.kinds != CATALOGUE["backlash"].kinds else "pressure"
    base = make.unseen(draw_scene(np.random.default_rng(4), kind, low=effect.low_pv, span=9.0, settle=100.0))
    low, high = math.log(effect.low), math.log(effect.high)
    strengths = [math.exp(low + share * (high - low)) for share in (0.0, 0.55, 0.85)]
    energies = [grade.energy_of(apply(effect, base, s, 5)[0], base.plant).energy for s in strengths]
    assert energies[0] < 60.0
    assert energies[0] - 4.0 < energies[1] < energies[2]


def test_a_case_without_an_effect_has_no_energy(short):
    """Without an effect, the error of the baseline model is smaller than a random parameter would cause."""
    for case in (c for c in plan.plan(12, 3) if not c.effects):
        base, scene, entries = make.hide(case, [])
        assert entries == []
        assert base is scene
        assert grade.energy_of(scene, scene.plant).energy < 2 * make.UNSEEN


def read(folder, tag, which):
    return pd.read_parquet(folder / f"{tag}-{which}.parquet")


def test_levels_are_kept(sealed):
    """The energies differ by at most 30 % from the energy of their level."""
    for truth in json.loads((sealed / "truth.json").read_text()).values():
        if "energy" in truth:
            assert truth["energy"] == pytest.approx(grade.LEVELS[truth["level"]], rel=0.3)


def test_the_true_plant_explains_the_later_recording(sealed):
    """On the later recording the residual of the true plant is only load and noise. The residual of the
    baseline model is larger."""
    truth = json.loads((sealed / "truth.json").read_text())["L0000"]
    assert truth["later_true"] < 0.9 * truth["later_plain"]
    assert truth["later_true"] < 2.0 * truth["floor"]


def test_later_recording_is_another_one(sealed):
    """Set points and loads of the later recording differ from those of the first."""
    for tag in ("L0000", "L0001", "L0004"):
        fit, later = read(sealed, tag, "fit"), read(sealed, tag, "later")
        n = min(len(fit), len(later))
        assert (fit[f"{tag}.SP"][:n].to_numpy() != later[f"{tag}.SP"][:n].to_numpy()).mean() > 0.5
        assert later.timestamp[0] > fit.timestamp.iloc[-1]


def test_exports_contain_only_trends(sealed):
    """Exports have only time stamps, SP, PV and OP. loops.csv has the controller settings, which are wrong only
    if the hidden effect is wrong settings."""
    truths = json.loads((sealed / "truth.json").read_text())
    loops = pd.read_csv(sealed / "loops.csv").set_index("loop")
    assert list(loops.columns) == ["type", "kp", "ti", "scan_s", "pv_lo", "pv_hi", "op_lo", "op_hi"]
    for tag, truth in truths.items():
        columns = [c for c in read(sealed, tag, "fit") if not c.startswith("N")]
        assert columns == ["timestamp", f"{tag}.SP", f"{tag}.PV", f"{tag}.OP"]
        stated = np.array([loops.kp[tag] / truth["base"]["Kp"], loops.ti[tag] / truth["base"]["Ti"]])
        assert np.allclose(stated, 1.0) != (truth["effect"] == "controller-settings")


def test_recording_defects_are_present(sealed):
    """The gap is a set of missing rows, and the outlier is one PV value far from the others."""
    gaps, odd = read(sealed, "L0004", "fit"), read(sealed, "L0005", "fit")
    assert gaps.timestamp.diff().max() > 3 * gaps.timestamp.diff().median()
    jump = odd["L0005.PV"].diff().abs().nlargest(3).to_numpy()
    assert jump[1] > 4.0 > jump[2] or jump[1] > 2 * jump[2]


def test_same_seed_same_files(sealed, short, tmp_path):
    """A case that is sealed again is identical to the last digit."""
    case = plan.Case("L0001", (("second-lag", "concealed"),), "", 12)
    make.write(tmp_path, [make.seal(tmp_path, [], case)])
    pd.testing.assert_frame_equal(read(tmp_path, "L0001", "fit"), read(sealed, "L0001", "fit"))
    truths = [json.loads((f / "truth.json").read_text())["L0001"] for f in (sealed, tmp_path)]
    assert truths[0] == truths[1]
