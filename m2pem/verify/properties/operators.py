"""Are operators asked what they can answer, and is every answer handled?"""

from m2pem.mission import elements as e
from m2pem.verify.properties.searched import Searched
from m2pem.verify.results import Result, Violation
from m2pem.verify.system import Flag, Trigger


def prompts_have_decisions(searched: Searched) -> Result:
    """Every prompt has a decision to choose."""
    violations = [
        Violation(f"{searched.label(node.id)} asks, and has no decision to answer with", (node.id,))
        for node in searched.mission.nodes
        if isinstance(node, e.UserTask) and node.prompt is not None and not node.prompt.decisions
    ]
    return searched.result(
        "prompts-have-decisions", "Every prompt can be answered.", violations, static=True
    )


def decisions_handled(searched: Searched) -> Result:
    """No decision of an operator leads to a gateway without a flow for it."""
    found, rules = searched.found, searched.system.rules
    violations: list[Violation] = []
    seen: set[tuple[str, str]] = set()
    for rule, state in sorted(found.fired.items(), key=lambda each: each[1]):
        thrown = [s for s in rules[rule].steps if s.action == "thrown" and s.detail == "NO_FLOW"]
        if not thrown:
            continue
        run = (*found.run_to(state), rule)
        asked = next((rules[r] for r in reversed(run) if rules[r].trigger is Trigger.ANSWER), None)
        if asked is None or (asked.element, thrown[0].element) in seen:
            continue
        seen.add((asked.element, thrown[0].element))
        violations.append(
            Violation(
                f"after {asked.detail!r} at {searched.label(asked.element)}, no flow of"
                f" {searched.label(thrown[0].element)} is true and it has no default",
                (thrown[0].element, asked.element),
                run,
            )
        )
    return searched.result(
        "decisions-handled", "Every decision of an operator is handled.", violations
    )


__all__ = ["Flag", "decisions_handled", "prompts_have_decisions"]
