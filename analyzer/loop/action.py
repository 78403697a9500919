"""Which action is chosen where several are asked for: the one place that says what outranks what.

An assessment advises by itself (analyzer/loop/advice.py). What its lanes ask for, the loop that it hangs on, and the
nights since its settings were changed may each outrank that; analyzer/words/orders.py says what to do.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from analyzer.loop.decisions import Action, Cause, Due, Finding, Lane, MissingData, Remedy, Status

ACTING = (Action.RETUNE, Action.REPAIR_VALVE)
"""Actions that change a loop."""
OPEN = (None, Action.NEEDS_DATA, Action.UNDECIDED)
"""Actions in whose place settings from an experiment are proposed."""
FIRST = (Action.CHECK_MEASUREMENT, Action.CHECK_SETTINGS, Action.CHECK_LIMIT)
"""What is done in the night that finds it: no settings of other nights hold where these are not known."""
AGAINST = {
    Cause.VALVE: (Action.REPAIR_VALVE, Action.CHECK_SETTINGS),
    Cause.TUNING: (Action.NEEDS_DATA, Action.CHECK_SETTINGS),
}
"""What is done against a cause where no settings are, the first unless the nights vote for another of them."""
NOTHING_SURER = (None, Action.NONE, Action.NEEDS_DATA, Action.CHECK_SETTINGS)
"""Actions in whose place a doubtful measurement is looked at first: what rests on it is doubtful too."""
NOTHING_ELSE = (Action.NONE, Action.UNDECIDED)
"""Actions in whose place it is found out what holds OP at its limit."""
OF_LACK = {MissingData.MANUAL_TEST: Action.UNDECIDED, MissingData.SWITCHES: Action.NONE}
"""What is done about a record that lacks something, where that is not to get more data."""


def for_lack(lack: MissingData | None) -> Action:
    """What is done about a record that lacks something for an answer or for settings."""
    return OF_LACK.get(lack, Action.NEEDS_DATA) if lack is not None else Action.NEEDS_DATA


def decided(found: Finding, doubtful: bool) -> Finding:
    """A finding whose lanes are known, with the action of all that is known of its night; doubtful, whether its lanes
    ask for a look at the measurement."""
    action, lanes = found.remedy.action, found.lanes
    if found.status is Status.NOT_ASSESSED and action is None:
        action = Action.NEEDS_DATA
    at_limit = action in NOTHING_ELSE and not {Lane.AT_LIMIT, Lane.WINDUP}.isdisjoint(lanes)
    if action in NOTHING_SURER and found.status is not Status.FAILED and doubtful:
        action = Action.CHECK_MEASUREMENT
    elif at_limit or (action is Action.NEEDS_DATA and found.lack is MissingData.OP_OFF_LIMITS):
        action = Action.CHECK_LIMIT
    elif action is Action.NONE and Lane.SLUGGISH in lanes:
        found, action = replace(found, lack=MissingData.STEP_TEST), Action.NEEDS_DATA
    return (
        found if action is found.remedy.action else replace(found, remedy=Remedy(action, found.remedy.text))
    )


def of_nights(
    cause: Cause,
    worn: bool,
    own: tuple[Cause, Action | None, Due | None],
    voted: Action | None,
    settled: Action,
) -> tuple[Action | None, Due | None]:
    """What is done about a loop that cycles, by all nights, and when a repair is due.

    cause, the one that the nights name; worn, whether its valve is; own, cause, action and due of the night by
    itself; voted, the action that the nights hold; settled, what is done where they name no cause.
    """
    own_cause, own_action, own_due = own
    if own_action in FIRST or own_due is Due.SHUTDOWN:
        return own_action, own_due
    if cause in AGAINST:
        usual = AGAINST[cause][0]
        action = voted if voted in (*AGAINST[cause], Action.RETUNE) else usual
        return action, Due.NOW if action is Action.REPAIR_VALVE else None
    if worn:
        return Action.REPAIR_VALVE, Due.SHUTDOWN
    if cause is not Cause.LOAD:
        return settled, None
    followed = own_cause is not Cause.LOAD or own_action is Action.SEE_SOURCE_LOOP
    return Action.FIND_DISTURBANCE if followed else own_action, None


def of_votes(votes: Mapping[Action, float]) -> Action:
    """What is done where no cause is named: that which most nights lacked something, or that their signs disagree."""
    lacking, disagreeing = (votes.get(a, 0.0) for a in (Action.NEEDS_DATA, Action.UNDECIDED))
    return Action.NEEDS_DATA if lacking > disagreeing else Action.UNDECIDED


def is_urgent(action: Action | None, due: Due | None) -> bool:
    """Whether a worn valve's loop is to be touched before the next shutdown."""
    return action is Action.RETUNE or (action is Action.REPAIR_VALVE and due is Due.NOW)
