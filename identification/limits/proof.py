"""Limits of the proof that an effect is there: on data that were not fitted, and spread over the record."""

from __future__ import annotations

from dataclasses import dataclass

from identification.limits.declare import limit


@dataclass(frozen=True, slots=True)
class ProofLimits:
    """When a candidate's gain is real: on data that were not fitted, and spread over the record."""

    answers: float = limit(
        12.5,
        "nat",
        (0.0, 1e6),
        "Log likelihood that OP must bring for PV to answer it",
        "ours: chance brings three constants under 8.5 in 999 of 1,000 records, and the model without OP is not "
        "fitted to the end",
    )
    time_constants: float = limit(
        5.0,
        "-",
        (0.0, 1e3),
        "Time constants that a recording of a process that settles must hold",
        "the catalogue's need; a step has then settled to 0.7 %",
    )
    proven: int = limit(
        3,
        "-",
        (1, 100),
        "Candidates that are put to the proof, best first, until one passes",
        "ours: bounds the time",
    )
    held_out: float = limit(
        0.35,
        "-",
        (0.05, 0.9),
        "Last part of the record that is held out when the winner is proven",
        "ours: two thirds to fit, one to prove",
    )
    held_out_loss: float = limit(
        -1.0,
        "nat",
        (-1e6, 1e6),
        "Gain on the held-out part under which an effect falls",
        "ours: chance moves it by about a half",
    )
    held_out_share: float = limit(
        0.1,
        "-",
        (0.0, 10.0),
        "Share of its whole gain by which it may fall below that",
        "ours: two thirds of a record know a slow effect's constants less well",
    )
    as_good: float = limit(
        1.05,
        "-",
        (1.0, 10.0),
        "Ratio of two misfits up to which two models simulate alike",
        "ours: misfits of one plain loop from different starts agree within a hundredth",
    )
    astray: float = limit(
        1.25,
        "-",
        (1.0, 10.0),
        "Ratio of held-out misfits to the best plain loop's from which an effect falls although it is seen one step "
        "ahead",
        "ours: of 49 effects on 120 sealed cases (seed 7707) seven right ones lie between 1 and 1.14, wrong ones "
        "from 1.56 on; a load that a controller answers lends the plain loop as much",
    )
    optima_apart: float = limit(
        2.0,
        "-",
        (1.0, 1e3),
        "Ratio of gains or time constants from which the plain loop that simulates best is told beside the one that "
        "foretells best",
        "ours: where neither load nor feedback biases one of them they are within a tenth",
    )
    seen_ahead: float = limit(
        9.0,
        "nat",
        (0.0, 1e6),
        "Gain on the held-out part from which an effect stands that simulates as well as a plain loop of other "
        "constants",
        "what the search and one constant cost",
    )
    least_fit: float = limit(
        1.0,
        "%",
        (-1e3, 100.0),
        "Fit on held-out data from which a model goes with PV",
        "ours: a stem that never moves has 0",
    )
    spread: float = limit(
        0.15,
        "-",
        (0.0, 1.0),
        "Share of the gain that must remain when the best tenth of the record is left out (loads excepted)",
        "ours",
    )
    one_move: float = limit(
        0.8,
        "-",
        (0.0, 1.0),
        "Share of OP's travel in two parts of twenty of the record from which it is one experiment without spread",
        "ours",
    )
    sound_valve: float = limit(
        0.1,
        "% OP",
        (0.0, 10.0),
        "Play or stickband below which a valve is in good order",
        "the narrowest dead band that a positioner can be set to (Siemens, SIPART PS2 operating instructions, "
        "A5E00074631, parameter DEBA: 0.1 to 10 %)",
    )
    bound_share: float = limit(
        0.005, "-", (0.0, 0.5), "Part of a constant's range within which it stands at the end of it", "ours"
    )
    window_times: float = limit(
        2.0,
        "-",
        (0.1, 1e3),
        "Length of the windows in which a model is judged where a run over all shows the load alone, in T + L of the "
        "plain loop",
        "ours: over simulated sealed cases the right effect then removes misfit in all but one, at 5 and 10 in fewer",
    )
    window_samples: int = limit(100, "-", (3, 1000000), "Fewest samples of such a window", "ours")
    least_cycle: int = limit(
        20,
        "-",
        (3, 1000000),
        "Fewest samples of a window in which the stem is placed anew",
        "ours: a line and the place are three numbers",
    )
    course_leaves: float = limit(
        0.3,
        "-",
        (0.0, 1.0),
        "Part of an experiment's misfit (mean square) that a supply may leave to be told without a gain of its own",
        "ours: a heater that failed leaves .18",
    )
    course_from: float = limit(
        0.4,
        "-",
        (0.0, 1.0),
        "The misfit that the plain loop then leaves at least, in PV's spread",
        "ours: loads that are no effect move PV less than OP does",
    )
