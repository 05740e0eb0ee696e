"""Which requirements of a mission its runs are monitored for."""

from collections.abc import Iterable, Mapping

from m2pem.engine.inputs import MonitoredRequirement
from m2pem.engine.records import RequirementMonitored
from m2pem.verify.ltl import show
from m2pem.verify.ltl.formula import (
    Active,
    Completed,
    Measured,
    needs_steps,
    show_measured,
    walk,
)
from m2pem.verify.requirements import Requirement


def monitored(requirements: Iterable[Requirement]) -> tuple[MonitoredRequirement, ...]:
    """Return those that can be monitored, and do not say that they are not to be."""
    return tuple(
        MonitoredRequirement(
            each.id,
            show(each.formula),
            each.english,
            tuple(
                dict.fromkeys(
                    named.element
                    for named in walk(each.formula)
                    if isinstance(named, Active | Completed)
                )
            ),
            each.on_violation,
            tuple(
                dict.fromkeys(
                    show_measured(part) for part in walk(each.formula) if isinstance(part, Measured)
                )
            ),
        )
        for each in requirements
        if each.monitor and can_be_monitored(each)
    )


def can_be_monitored(requirement: Requirement) -> bool:
    """Whether runs can be monitored for it. For a formula about single steps they cannot: the steps
    are those of the checker's net."""
    return not needs_steps(requirement.formula)


def carried_over(
    before: Mapping[str, RequirementMonitored], now: Iterable[MonitoredRequirement]
) -> frozenset[str]:
    """Return the ids of requirements whose monitors go on as they are: of the same formula."""
    return frozenset(
        each.id for each in now if each.id in before and before[each.id].formula == each.formula
    )
