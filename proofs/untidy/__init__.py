"""Loops as plants record them, with truths: a second generator, independent of the plants that set the thresholds.

Valves have LuGre friction (Canudas de Wit, Olsson, Astrom, Lischinsky 1995), whose level changes from slip to slip
and from place to place, or backlash. Some have a positioner that oscillates by itself. Set points are constant, step,
ramp or come from a master. Loads step, ramp, wander and have busy hours. Periodic loads are sines, squares or pulses
whose period varies. Flows have slow integral controllers. The recordings are thinned, rounded and compressed. Shares
no code with identification or with any other generator.

    python -m proofs.untidy FOLDER [--loops 90] [--seed 1]
"""
