"""What each property means, and how a violation is corrected: help for people in a report.

The table in docs/verification.md says the same.
"""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Help:
    """Plain text; ids and values are in backticks."""

    means: str
    correction: str


HELP: Mapping[str, Help] = {
    "no-deadlock": Help(
        "no token is stuck forever; the answer names the stuck elements",
        "join with the kind of gateway that forked",
    ),
    "proper-completion": Help(
        "no end event is reached twice in one instance of its scope",
        "join with a parallel gateway",
    ),
    "can-complete": Help(
        "from everywhere, the end can be reached",
        "correct the deadlock or livelock",
    ),
    "completes-if-fair": Help(
        "the mission ends, if each outcome that is possible infinitely often happens infinitely"
        " often",
        "of two operators who are asked until they agree, let one decide after some rounds",
    ),
    "no-livelock": Help(
        "no cycle is without a way out",
        "a flow that leads out, and a decision that takes it",
    ),
    "no-dead-element": Help(
        "every element is reached in some run",
        "spell the condition as the decision is spelled, or delete the element",
    ),
    "one-token": Help(
        "tokens of a fork do not meet again without a join",
        "a gateway in front of the task where they meet",
    ),
    "can-be-triggered": Help(
        "every awaited signal or message has a sender: an element, or operators",
        'refer to the same signal; if operators send it, say `m2pem:from="operator"`',
    ),
    "is-caught": Help(
        "a signal or escalation that is thrown can be caught",
        "a boundary event around it with the same escalation",
    ),
    "one-behavior": Help(
        "no vehicle or payload is commanded by two behaviors at once",
        "one after the other, or another vehicle",
    ),
    "interrupted-commanded-again": Help(
        "an interrupted vehicle is commanded again, or stopped, by the model",
        "a task for each of them after the interruption",
    ),
    "errors-caught": Help(
        "no error that the model throws ends the run uncaught",
        "a boundary event around it, or, if the mission is given up, a terminate end event",
    ),
    "failures-handled": Help(
        "work that may fail has an error boundary event",
        "an error boundary event, and tasks after it",
    ),
    "prompts-have-decisions": Help(
        "every prompt can be answered",
        "offer decisions",
    ),
    "decisions-handled": Help(
        "no decision leads to a gateway that has no flow for it",
        "a flow for it, or a default flow",
    ),
}
