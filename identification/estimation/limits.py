"""Every number that decides an answer, with its reason. Gains are of log likelihood [nat]."""

from __future__ import annotations

PARAMETER_PENALTY = 3.0
"""Gain that one more constant has to bring; ours: half of log(n) would be 4.5, chance brings a half."""
SEARCH_PENALTY = 6.0
"""Gain that the choice among some forty candidates and their starts costs; ours: the largest of forty by chance."""
ROUNDS = 3
"""Effects named at most; a record seldom tells more."""
FOLLOWED = 6
"""Candidates that are followed to the end from several starts."""
SCREEN_STEPS = 5
"""Gauss-Newton steps in the first round."""
FULL_STEPS = 20
"""Gauss-Newton steps of those that are followed."""
SETTLED = 0.025
"""Gain of a step below which the descent ends."""
PROMISES = 5.0
"""Times what its next step promises that a candidate of the first round may lack of what is worth following, else it
ends; ours: of 2,727 descents on 40 cases of another seed two would have come there, of valves that are scanned
anyway."""
WORTH_FOLLOWING = -6.0
"""Gain less its price [nat] from which a candidate of the first round is followed; ours: of 242 below it on the same
cases one came to anything, 0.6."""
TIE = 2.0
"""Candidates within this gain of the winner cannot be told from it and are its alternatives."""
HELD_OUT = 0.35
"""Last part of the record that is held out when the winner is proven."""
SPREAD = 0.15
"""Share of the gain that must remain when the best tenth of the record is left out (loads excepted)."""
LAW_SPAN = 40
"""Fewest samples in a span of the controller's regression."""
LAW_SPANS = 12
"""Fewest spans in it."""
SHIFTS = (-2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0)
"""Latenesses of PV that are tried [samples]."""
FILTERS = (0.5, 1.0, 2.0, 4.0, 8.0)
"""Time constants of a filter between PV and the controller that are tried [samples]."""
FILTER_GAINS = 0.9
"""Residual with such a filter, in terms of that without, from which it is believed; ours."""
STRAIGHT = 0.3
"""Share of samples on straight slopes from which a trend counts as compressed; ours: rounding alone leaves under
0.27."""
STRAIGHT_LAW = 0.1
"""The same from which the controller is not judged: its law acted on what was not stored; ours: trends on a grid have
no such lines, and a law found on drawn ones was off by half in Ti."""
GRID_STEP = 0.06
"""Step of values [% of span] from which it is the sensor's and not the historian's, which keeps 0.05 or finer."""
GRID_STEP_OF_RANGE = 2.0
"""The same where percent is of the recorded range."""
GRID_MARK = 1.0
"""Standard deviation of what an effect changes in PV, in steps of PV's grid, from which the grid does not hide it;
ours: rounding has 0.29, and healthy untidy loops with effects that are not there had 0.13."""
CLIP_SAMPLES = 15
"""Fewest samples at one extreme that count as clipped."""
CLIP_RATIO = 4.0
"""Times that the extreme is commoner than each of its six neighbours."""
JITTER = 0.02
"""Scatter of stamps [samples] from which it is the polling; logging alone scatters by 0.01."""
LATE = 1.4
"""Lateness of PV's clock [samples] from which it is named; ours: jitter and filters stay under 0.8."""
SETTING = 0.055
"""Logarithm of found over stated setting from which it is named; ours: sound loops stay under 0.03."""
LAW_EXPLAINS = 0.9
"""Share of OP that a law has to give before its settings are believed."""
GAPS = (0.05, 0.07, 0.1, 0.14, 0.2, 0.28, 0.4, 0.55, 0.75, 1.0, 1.35, 1.8, 2.5, 3.5, 5.0)
"""Gaps tried, in medians of the error's size."""
GAP_LEAVES = 0.8
"""Residual of the median span under the best gap, in terms of that without one, from which a gap is named."""
STUCK_RUN = 20
"""Samples of a constant OP that a law would have moved before it counts as ruled by logic."""
STUCK_MOVE = 6.0
"""Moves missed in such a run, in steps of OP's resolution."""
STUCK_SHARE = 0.006
"""Share of the record in such runs from which logic is named."""
SAME_LAW = 1.15
"""Times the residual of the law found that the stated law may leave in the median span and still be believed."""
FROZEN = 0.55
"""Share of due moves of OP that do not happen within a gap."""
FROZEN_MOVES = 25
"""Due moves within a gap before one is named."""
LAWLESS = 5.0
"""Residual of a span, in medians of all spans (plus a step of OP), from which the law does not hold there."""
LAWLESS_SHARE = 0.03
"""Share of the record in such spans from which logic is named; ours: gaps and single outliers stay under it."""
HELD_OUT_LOSS = -1.0
"""Gain on the held-out part under which an effect falls; ours: chance moves it by about a half."""
PROVEN = 3
"""Candidates that are put to the proof, best first, until one passes."""
CEILING_PENALTY = 22.5
"""Gain beyond half the number of its weights that the flexible model needs over the last fit before something is
said to be left; ours: with nothing hidden the largest of thirty was 18."""
CEILING_SHARE = 0.3
"""The same in terms of what the named effects gain: a name stands if little is left beside it."""
START_SCATTER = 1.0
"""Standard deviation [% PV] of the model's first value about the recorded one, which short time constants need."""
STICKING_HINT = 6.0
"""Gain of a play, or of a sticking valve started coarsely, from which stiction is scanned finely."""
ONE_MOVE = 0.8
"""Share of OP's travel in two parts of the record from which it is one experiment without spread."""
BIAS_SCATTER = 20.0
"""Standard deviation [% PV] of the model's bias about the record's mean."""
HELD_OUT_SHARE = 0.1
"""The same in terms of the whole gain: two thirds of a record know a slow effect's constants less well."""
SETTLES = 0.1
"""Share of the record that a time constant may take if the loop is to be seen to settle."""
SAME = 1.0
"""Gain that a model may lack beside one with a constant more and still count as good as that."""
MISSED = 1.8
"""Spacing of stamps [samples] from which a sample is missing; ours: polling scatters by less."""
ASKED = 0.5
"""Move of SP within a sample [% PV] from which the kick of OP, not the law, is seen; ours: ramps are slower."""
LEAST_CYCLE = 20
"""Fewest samples of a window in which the stem is placed anew: a line and the place are three numbers."""
LEAST_TI = 4.0
"""Integral time [samples] from which the law is judged on a thinned recording; ours: under it found settings of sound
loops are off by up to half."""
THINNED = 1.5
"""Scans per sample from which a recording is thinned."""
THINNED_LEAVES = 0.1
"""Share of OP's variance that stated settings may leave on a thinned recording: the sum of a few values of a noisy
error is not its integral, and a Kp a third off leaves that much; ours."""
SETTING_THINNED = 0.3
"""SETTING on thinned recordings: values of PV that were not kept moved OP, which biases a found law; ours: at ten
scans a sample sound loops of the sample mill reach 0.26."""
WINDOW_TIMES = 2.0
"""Length of the windows in which a model is judged where a run over all shows the load alone, in T + L of the plain
loop; ours: over the shared sealed cases the right effect then removes misfit in all but one, at 5 and 10 in fewer."""
WINDOW_SAMPLES = 100
"""Fewest samples of such a window."""
