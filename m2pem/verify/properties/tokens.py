"""Is there one token where one is meant?"""

from m2pem.verify.properties.searched import Searched
from m2pem.verify.results import Result, Violation


def proper_completion(searched: Searched) -> Result:
    """Nothing is left behind, and no end event is reached twice in one instance of its scope."""
    violations: list[Violation] = []
    found = searched.found
    for place in found.overflows:
        each = searched.system.places[place]
        if each.once:
            violations.append(
                Violation(
                    f"{searched.label(each.element)} is reached twice in one instance of its scope",
                    (each.element,),
                    found.overflow_runs[place],
                )
            )
    return searched.result(
        "proper-completion",
        "No end event is reached twice in one instance of its scope.",
        violations,
    )


def one_token_each(searched: Searched) -> Result:
    """No element has two tokens at a time where the mission means one."""
    violations: list[Violation] = []
    found = searched.found
    for place in found.overflows:
        each = searched.system.places[place]
        if each.once:
            continue
        more = " and more and more" if place in found.beyond else ""
        violations.append(
            Violation(
                f"{searched.label(searched.node_of(each.element))} gets a second token{more}"
                " before the first has left: tokens that were parted are not joined",
                (searched.node_of(each.element),),
                found.overflow_runs[place],
            )
        )
    return searched.result(
        "one-token", "Tokens that were parted do not meet again unjoined.", violations
    )
