"""Loops as plants record them, with truths: a second generator beside the plants that the thresholds were set on.

Valves have LuGre friction (Canudas de Wit, Olsson, Astrom, Lischinsky 1995) whose level changes from slip to slip and
from place to place, or play; some have a positioner that hunts by itself. Set points stand, step, ramp or come from a
master; loads step, ramp, wander and have busy hours; periodic loads are sines, squares or pulses whose period
wanders. Flows have slow integral controllers. What is recorded is thinned, rounded and compressed. Shares no code
with identification or with any other generator.

    python -m proofs.untidy FOLDER [--loops 90] [--seed 1]
"""
