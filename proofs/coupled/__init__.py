"""Plants of interacting loops, with truths: which loops share an oscillation, and at which loop it starts.

All loops of a plant step together: processes with lag or integration and dead time, PI controllers, valves. A fault
at one loop spreads through gains, filters and delays to neighbours and on, meets others, comes back by recycles, and
goes up and down cascades. Other loops oscillate by themselves, some with nearly a source's period. The truth is
measured: the same plant with the same draws is run again without each fault.

Shapes: oscillations that spread through a plant, their causes and recycles as Thornhill and Horch 2007 ("Advances and
new directions in plant-wide disturbance detection and diagnosis") review them; stiction of two levels as He, Wang,
Pottmann and Qin 2007 ("A curve fitting method for detecting valve stiction in oscillating control loops"); sound
controllers by internal model control (Rivera, Morari and Skogestad 1986). Shares no code with the estimators.

    python -m proofs.coupled FOLDER [--plants 1] [--seed 1] [--loops N]
"""
