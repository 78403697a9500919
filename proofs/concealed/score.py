#!/usr/bin/env python3
"""Compares answers with truths: right names, blocks, false alarms, recovered misfit, parameters.

score.py CASES OUT [--out docs/evidence/PROOF.md]
"""

import argparse
import json
import pathlib
import sys

import numpy as np
import pandas as pd

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))

SAME_MARK = [{"valve-characteristic", "nonlinear-gain"}]  # indistinguishable when OP alone moves PV
INDISTINGUISHABLE = [*SAME_MARK, {"sensor-lag", "second-lag"}, {"stiction", "positioner"}]
ABSTAINED = {"none", "unexplained"}
SHARED = {  # parameter of the truth: the name that an answer gives it
    "backlash": "backlash_pct",
    "stick_S": "stickband_pct",
    "stick_J": "slip_jump_pct",
    "rate": "rate_pct_per_s",
    "vmax": "limit_pct",
    "bend": "curve",
    "positioner_lag": "positioner_lag_s",
    "deadband": "deadband_pct",
    "split_at": "split_pct",
    "split_ratio": "gain_ratio",
    "T2": "second_lag_s",
    "lag": "second_lag_s",
    "slow_share": "slow_share",
    "slow_T": "slow_time_constant_s",
    "ratio_down_up": "ratio_down_up",
    "gain_slope": "gain_slope",
    "root": "root",
    "cap": "cap_pct",
    "flow_delay": "flow_share",
    "gain_drift": "gain_drift",
    "quant": "step_pct",
    "pv_clip": "clip_pct",
    "pv_late_by_s": "shift_s",
    "Kp": "kp",
    "Ti": "ti_s",
    "gap": "gap_pct",
    "period": "period_s",
    "coupling_gain": "coupling_gain",
}
REPORTED_AS = {"sensor-lag": "second-lag"}  # same name, since OP and PV cannot distinguish them


def answer_of(out: pathlib.Path, tag: str) -> dict:
    """The answer as given; without one the verdict is `no answer`."""
    try:
        answer = json.loads((out / f"{tag}.json").read_text())
        return answer if isinstance(answer, dict) and "verdict" in answer else {"verdict": "no answer"}
    except (OSError, ValueError):
        return {"verdict": "no answer"}


def recovered(cases: pathlib.Path, out: pathlib.Path, tag: str, truth: dict) -> float:
    """Share of the recoverable misfit power that the answer recovers on the later recording; or NaN."""
    baseline, floor = truth.get("later_plain", 0.0) ** 2, truth.get("later_true", 1.0) ** 2
    if baseline < 1.1 * floor:
        return np.nan
    try:
        pv = pd.read_parquet(cases / f"{tag}-later.parquet")[f"{tag}.PV"].to_numpy(float)
        residual = float(np.var(pv - pd.read_parquet(out / f"{tag}.sim.parquet")["PV"].to_numpy(float)))
    except (OSError, KeyError, ValueError):
        return 0.0
    return (
        float(np.clip((baseline - residual) / (baseline - floor), -1.0, 1.2))
        if np.isfinite(residual)
        else 0.0
    )


def indistinguishable(a: str, b: str, groups: list[set[str]]) -> bool:
    """Whether two names are equal or belong to one group."""
    return a == b or any({a, b} <= g for g in groups)


def right_name(truth: dict, answer: dict) -> tuple[bool, bool]:
    """Whether the name is right, and whether it is right with indistinguishable effects and named alternatives."""
    due = truth.get("pair", [truth["effect"]])
    if truth.get("outside"):
        return answer["verdict"] == "unexplained", answer["verdict"] in ABSTAINED
    strict = any(indistinguishable(answer["verdict"], d, SAME_MARK) for d in due)
    others = [a for e in answer.get("effects", [])[:1] for a in e.get("alternatives", [])]
    return strict, strict or any(
        indistinguishable(answer["verdict"], d, INDISTINGUISHABLE) or d in others for d in due
    )


def parameters(truth: dict, answer: dict) -> list[dict]:
    """Parameters that occur in truth and answer: relative error, and whether the interval contains the truth."""
    found = []
    given = {
        k: v
        for e in answer.get("effects", [])
        if e["name"] in (truth["effect"], REPORTED_AS.get(truth["effect"]))
        for k, v in e["parameters"].items()
    }
    hidden = dict(truth.get("hidden", {}))
    if "T_up" in hidden:
        hidden["ratio_down_up"] = hidden["T_down"] / hidden["T_up"]
    for key, true in hidden.items():
        hit = given.get(SHARED.get(key, ""))
        if hit is None or not true or hit.get("value") is None:
            continue
        low, high = hit.get("low"), hit.get("high")
        inside = low <= true <= high if low is not None and high is not None else None
        row = {"effect": truth["effect"], "parameter": key, "true": true, "found": hit["value"]}
        found.append(row | {"error": hit["value"] / true - 1.0, "inside": inside})
    return found


def baseline_errors(out: pathlib.Path, tag: str, truth: dict) -> dict[str, float]:
    """Relative errors of the baseline model's gain, time constant and dead time in the saved model."""
    try:
        found = json.loads((out / f"{tag}.model.json").read_text())["constants"]
        return {f"{k}_error": found.get(k, 0.0) / truth["base"][k] - 1.0 for k in "KTL"}
    except (OSError, ValueError, KeyError, AttributeError):
        return {}


def judge(cases: pathlib.Path, out: pathlib.Path) -> tuple[pd.DataFrame, pd.DataFrame]:
    """One row for each case, and one row for each parameter that occurs in truth and answer."""
    rows, params = [], []
    for tag, truth in json.loads((cases / "truth.json").read_text()).items():
        answer = answer_of(out, tag)
        strict, lenient = right_name(truth, answer)
        keep = {k: truth.get(k) for k in ("effect", "level", "kind", "oddity", "energy", "strength")}
        names = {e["name"] for e in answer.get("effects", [])}
        rows.append(
            keep
            | {"loop": tag, "verdict": answer["verdict"], "strict": strict, "lenient": lenient}
            | {"block": answer.get("block") == truth["block"], "group": group_of(truth)}
            | {"both": names >= set(truth.get("pair", [])), "recovered": recovered(cases, out, tag, truth)}
            | {"seconds": seconds_of(out, tag)}
            | baseline_errors(out, tag, truth)
        )
        params += [{"loop": tag, "level": truth["level"]} | p for p in parameters(truth, answer)]
    return pd.DataFrame(rows), pd.DataFrame(params)


def group_of(truth: dict) -> str:
    """The group of the set to which a case belongs."""
    if truth["effect"] == "none":
        return "none"
    if truth.get("outside"):
        return "outside"
    if "pair" in truth:
        return "pair"
    return "information" if "energy" in truth else "size"


def seconds_of(out: pathlib.Path, tag: str) -> float:
    """Duration of the explanation [s]."""
    try:
        return float(json.loads((out / f"{tag}.log.json").read_text())["explain"]["seconds"])
    except (OSError, ValueError, KeyError):
        return float("nan")


def report(cases: pathlib.Path, out: pathlib.Path, proof: pathlib.Path | None) -> str:
    """Text of the results; written with its picture when `proof` names a file."""
    from proofs.concealed.proof import draw, place, section

    rows, params = judge(cases, out)
    if proof is None:
        return section(rows, params, None)
    picture = proof.with_name(f"{proof.stem.lower()}-concealed.png")
    draw(rows, picture)
    text = section(rows, params, picture.name)
    place(proof, text)
    return text


def main() -> None:
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("cases", type=pathlib.Path)
    ap.add_argument("answers", type=pathlib.Path)
    ap.add_argument("--out", type=pathlib.Path, help="file that takes the results' section, e.g. PROOF.md")
    a = ap.parse_args()
    print(report(a.cases, a.answers, a.out))


if __name__ == "__main__":
    main()
