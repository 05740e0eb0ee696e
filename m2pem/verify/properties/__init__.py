"""Properties that are checked of every mission; `ALL` lists them."""

from collections.abc import Callable

from m2pem.verify.properties.commands import (
    errors_caught,
    failures_handled,
    interrupted_commanded_again,
    one_behavior_each,
)
from m2pem.verify.properties.events import (
    can_be_triggered,
    decisions_handled,
    is_caught,
    prompts_have_decisions,
)
from m2pem.verify.properties.results import Result, SearchedMission
from m2pem.verify.properties.soundness import (
    can_complete,
    completes_if_fair,
    no_dead_element,
    no_deadlock,
    no_livelock,
    one_token_each,
    proper_completion,
)

ALL: tuple[Callable[[SearchedMission], Result], ...] = (
    no_deadlock,
    proper_completion,
    can_complete,
    completes_if_fair,
    no_livelock,
    no_dead_element,
    one_token_each,
    can_be_triggered,
    is_caught,
    one_behavior_each,
    interrupted_commanded_again,
    errors_caught,
    failures_handled,
    prompts_have_decisions,
    decisions_handled,
)

NAMES = (
    "no-deadlock",
    "proper-completion",
    "can-complete",
    "completes-if-fair",
    "no-livelock",
    "no-dead-element",
    "one-token",
    "can-be-triggered",
    "is-caught",
    "one-behavior",
    "interrupted-commanded-again",
    "errors-caught",
    "failures-handled",
    "prompts-have-decisions",
    "decisions-handled",
)
"""The names of `ALL`."""

__all__ = ["ALL", "NAMES", "SearchedMission"]
