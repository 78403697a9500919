"""Choice of the action if several apply: the one place with their order of precedence.

An assessment gives its own advice (analyzer/loop/advice/advise.py). Its lanes, the loop that it follows, and
the nights since its settings were changed may each replace that; analyzer/words/orders.py words the action.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from analyzer.loop.decisions import Action, Cause, Due, Finding, Lane, MissingData, Remedy, Status

ACTING = (Action.RETUNE, Action.REPAIR_VALVE)
"""Actions that change a loop."""
OPEN = (None, Action.NEEDS_DATA, Action.UNDECIDED)
"""Actions that settings from an experiment replace."""
FIRST = (Action.CHECK_MEASUREMENT, Action.CHECK_SETTINGS, Action.CHECK_LIMIT)
"""Actions taken in the night that finds them: settings of other nights are not valid while these are open."""
AGAINST = {
    Cause.VALVE: (Action.REPAIR_VALVE, Action.CHECK_SETTINGS),
    Cause.TUNING: (Action.NEEDS_DATA, Action.CHECK_SETTINGS),
}
"""Actions against a cause if there are no settings, the first unless the nights vote for another of them."""
NOTHING_SURER = (None, Action.NONE, Action.NEEDS_DATA, Action.CHECK_SETTINGS)
"""Actions that a check of a doubtful measurement replaces: results based on it are doubtful too."""
NOTHING_ELSE = (Action.NONE, Action.UNDECIDED)
"""Actions that a check of the cause of OP at its limit replaces."""
OF_LACK = {MissingData.MANUAL_TEST: Action.UNDECIDED, MissingData.SWITCHES: Action.NONE}
"""Actions for missing data other than to get more data."""


def for_lack(lack: MissingData | None) -> Action:
    """Action for a record with missing data for an answer or for settings."""
    return OF_LACK.get(lack, Action.NEEDS_DATA) if lack is not None else Action.NEEDS_DATA


def decided(found: Finding, doubtful: bool) -> Finding:
    """A finding with known lanes, and the action from all data of its night; doubtful, whether its lanes require a
    check of the measurement."""
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
    """Action for a loop that cycles, from all nights, and the due time of a repair.

    cause, the one that the nights name; worn, whether its valve is; own, cause, action and due of the night by
    itself; voted, the action of the nights' vote; settled, the action if they name no cause.
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
        steps = cause is own_cause is Cause.UNDECIDED and own_action is voted is Action.RETUNE
        return Action.RETUNE if steps else settled, None
    followed = own_cause is not Cause.LOAD or own_action is Action.SEE_SOURCE_LOOP
    return Action.FIND_DISTURBANCE if followed else own_action, None


def of_votes(votes: Mapping[Action, float]) -> Action:
    """Action if no cause is named: more data if most nights had missing data, else undecided: signs disagree."""
    lacking, disagreeing = (votes.get(a, 0.0) for a in (Action.NEEDS_DATA, Action.UNDECIDED))
    return Action.NEEDS_DATA if lacking > disagreeing else Action.UNDECIDED


def is_urgent(action: Action | None, due: Due | None) -> bool:
    """Whether the loop of a worn valve needs action before the next shutdown."""
    return action is Action.RETUNE or (action is Action.REPAIR_VALVE and due is Due.NOW)
