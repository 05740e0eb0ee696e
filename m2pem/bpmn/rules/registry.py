"""All rules: of BPMN, whoever checks them, and of m2pem's own."""

from collections.abc import Mapping

from m2pem.bpmn.rules import (
    activities,
    collaboration,
    compensation,
    correlation,
    data,
    data_flow,
    definitions,
    event_gateways,
    events,
    extensions,
    flows,
    gateways,
    lanes,
    loops,
    message_flows,
    own_rules,
    reader_process_rules,
    reader_rules,
    references,
    services,
    shapes,
    structure,
    subprocesses,
    values,
)
from m2pem.bpmn.rules.rule import Rule, Topic

TOPICS: tuple[Topic, ...] = (
    structure.TOPIC,
    references.TOPIC,
    correlation.TOPIC,
    services.TOPIC,
    flows.TOPIC,
    gateways.TOPIC,
    event_gateways.TOPIC,
    activities.TOPIC,
    loops.TOPIC,
    subprocesses.TOPIC,
    events.TOPIC,
    definitions.TOPIC,
    compensation.TOPIC,
    data.TOPIC,
    data_flow.TOPIC,
    collaboration.TOPIC,
    message_flows.TOPIC,
    lanes.TOPIC,
    values.TOPIC,
    values.TRUTHS,
    shapes.TOPIC,
    reader_rules.TOPIC,
    reader_process_rules.TOPIC,
    own_rules.TOPIC,
    extensions.TOPIC,
)

RULES: tuple[Rule, ...] = tuple(
    sorted(
        {rule for topic in TOPICS for rule in topic.rules},
        key=lambda rule: rule.number,
    )
)
"""Every rule once, by number."""

BY_SLUG: Mapping[str, Rule] = {rule.slug: rule for rule in RULES}


def code(slug: str) -> str:
    """The number of a finding's rule as it is shown (B10611), or "" when it has none."""
    rule = BY_SLUG.get(slug)
    return "" if rule is None else rule.code
