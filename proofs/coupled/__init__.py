"""Plants of coupled loops, with truths: which loops share an oscillation, and at which loop it starts.

All loops of a plant are simulated together: processes with lag or integration and dead time, PI controllers, valves.
The oscillation of a faulty loop spreads through gains, filters and delays to neighbours and further. It meets other
oscillations, returns through recycles, and passes up and down cascades. Other loops oscillate independently, some
with nearly the period of a source. The truth is measured: the same plant is simulated again with the same random
numbers, without each fault.

Sources: Thornhill and Horch 2007 ("Advances and new directions in plant-wide disturbance detection and diagnosis")
review oscillations that spread through a plant, their causes and recycles. Stiction of two levels follows He, Wang,
Pottmann and Qin 2007 ("A curve fitting method for detecting valve stiction in oscillating control loops").
Controllers of loops without a fault are tuned by internal model control (Rivera, Morari and Skogestad 1986). Shares
no code with the estimators.

    python -m proofs.coupled FOLDER [--plants 1] [--seed 1] [--loops N]
"""
