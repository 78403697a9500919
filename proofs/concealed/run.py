#!/usr/bin/env python3
"""Runs a triage command to explain every sealed case; opens the truths only after the last answer.

run.py CASES OUT --triage "triage" --jobs 2 [--proof docs/evidence/PROOF.md]
"""

import argparse
import json
import os
import pathlib
import shlex
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))

TIMEOUT_S = 300


def tags(cases: pathlib.Path) -> list[str]:
    """Loops with a recording to fit; a neighbour has no recording of its own."""
    return sorted(f.name.removesuffix("-fit.parquet") for f in cases.glob("*-fit.parquet"))


def call(command: list[str]) -> dict:
    """Run a command; its output, exit status and duration [s]."""
    begun = time.time()
    env = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=TIMEOUT_S, env=env, check=False
        )
        status, output, complaint = done.returncode, done.stdout, done.stderr[-2000:]
    except subprocess.TimeoutExpired:
        status, output, complaint = -1, "", f"no answer in {TIMEOUT_S} s"
    return {"status": status, "output": output, "complaint": complaint, "seconds": time.time() - begun}


def put(path: pathlib.Path, text: str) -> None:
    """Write a file completely or not at all."""
    part = path.with_name(path.name + ".part")
    part.write_text(text)
    part.replace(path)


def explain_case(triage: list[str], cases: pathlib.Path, out: pathlib.Path, tag: str) -> None:
    """Explanation, model and simulation of one case; TAG.log.json is written last and marks it as done."""
    if (out / f"{tag}.log.json").exists():
        return
    loop = ["--loops", str(cases / "loops.csv"), "--loop", tag]
    model, sim = str(out / f"{tag}.model.json"), str(out / f"{tag}.sim.parquet")
    fit, later = (str(cases / f"{tag}-{w}.parquet") for w in ("fit", "later"))
    explained = call([*triage, "explain", fit, *loop, "--save-model", model, "--format", "json"])
    put(out / f"{tag}.json", explained.pop("output"))
    drawn = call([*triage, "simulate", model, later, *loop, "--out", sim])
    drawn.pop("output")
    put(out / f"{tag}.log.json", json.dumps({"explain": explained, "simulate": drawn}))


def run(triage: str, cases: pathlib.Path, out: pathlib.Path, jobs: int) -> None:
    """Explain every case that has no answer yet."""
    out.mkdir(parents=True, exist_ok=True)
    todo = tags(cases)
    with ThreadPoolExecutor(jobs) as pool:
        answers = pool.map(lambda tag: explain_case(shlex.split(triage), cases, out, tag), todo)
        for i, _ in enumerate(answers, 1):
            print(f"\r{i} of {len(todo)}", end="", file=sys.stderr)
    print(file=sys.stderr)


def main() -> None:
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("cases", type=pathlib.Path)
    ap.add_argument("out", type=pathlib.Path)
    ap.add_argument("--triage", default="triage", help="the command, e.g. 'triage' or '.venv/bin/triage'")
    ap.add_argument("--jobs", type=int, default=2)
    ap.add_argument("--proof", type=pathlib.Path, help="write the results' text and picture there")
    a = ap.parse_args()
    run(a.triage, a.cases, a.out, a.jobs)
    from proofs.concealed.score import report

    print(report(a.cases, a.out, a.proof))


if __name__ == "__main__":
    main()
