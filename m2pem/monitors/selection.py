"""Which requirements of a mission its runs are monitored for."""

from collections.abc import Iterable, Mapping

from m2pem.engine.inputs import MonitoredRequirement
from m2pem.engine.records import RequirementMonitored
from m2pem.verify.ltl import show
from m2pem.verify.ltl.formula import Active, Completed, needs_steps, walk
from m2pem.verify.requirements import Requirement


def monitored(requirements: Iterable[Requirement]) -> tuple[MonitoredRequirement, ...]:
    """Return those that can be monitored, and do not say that they are not to be.

    A formula about single steps cannot: they are those of the checker's net.
    """
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
        )
        for each in requirements
        if each.monitor and not needs_steps(each.formula)
    )


def carried_over(
    before: Mapping[str, RequirementMonitored], now: Iterable[MonitoredRequirement]
) -> frozenset[str]:
    """Return the ids of requirements whose monitors go on as they are: of the same formula."""
    return frozenset(
        each.id for each in now if each.id in before and before[each.id].formula == each.formula
    )
