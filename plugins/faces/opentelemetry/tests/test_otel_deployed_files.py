"""The table of docs/metrics.md, the Grafana dashboard and the alerts: all name metrics that are."""

import json
import re

from m2pem_plugin_opentelemetry.metrics import METRICS, Kind
from ruamel.yaml import YAML

from tests.command_line import REPOSITORY

DASHBOARD = REPOSITORY / "deploy" / "grafana" / "m2pem.json"
RULES = REPOSITORY / "deploy" / "prometheus" / "m2pem.rules.yml"
PAGE = REPOSITORY / "docs" / "metrics.md"


def exported() -> set[str]:
    """The names of all samples at `/metrics`."""
    names = set()
    for metric in METRICS.values():
        ends = {
            Kind.COUNTER: ("_total",),
            Kind.GAUGE: ("",),
            Kind.HISTOGRAM: ("_bucket", "_count", "_sum"),
        }[metric.kind]
        names |= {f"{metric.prometheus_name}{end}" for end in ends}
    return names


def named(expression: str) -> set[str]:
    return set(re.findall(r"\bm2pem_\w+", expression))


def labels_of(expression: str) -> set[tuple[str, str]]:
    """Each metric of an expression with a label that it is selected by."""
    return {
        (name, label)
        for name, selectors in re.findall(r"\b(m2pem_\w+)\{([^}]*)\}", expression)
        for label in re.findall(r"(\w+)[=!]", selectors)
    }


def test_the_dashboard_names_metrics_and_labels_that_are_exported() -> None:
    dashboard = json.loads(DASHBOARD.read_text())
    expressions = [each["expr"] for panel in dashboard["panels"] for each in panel["targets"]]
    assert len(expressions) > 20
    labels = {each.prometheus_name: each.labels for each in METRICS.values()}
    for expression in expressions:
        assert named(expression), expression
        assert named(expression) <= exported(), expression
        for name, label in labels_of(expression):
            known = labels[re.sub(r"_(total|bucket|count|sum)$", "", name)]
            assert label in {*known, "instance"}, expression
    places = [tuple(panel["gridPos"].values()) for panel in dashboard["panels"]]
    assert len(set(places)) == len(places)


def test_the_alerts_name_metrics_that_are_exported() -> None:
    groups = YAML(typ="safe").load(RULES.read_text())["groups"]
    rules = [rule for group in groups for rule in group["rules"]]
    assert rules
    for rule in rules:
        assert named(rule["expr"]) <= exported(), rule
        assert rule["annotations"]["summary"].endswith(".")


def test_the_documentation_has_the_table_of_all_metrics() -> None:
    rows = [
        f"| `{each.name}` | `{each.prometheus_name}{'_total' if each.kind is Kind.COUNTER else ''}`"
        f" | {each.kind} | {', '.join(f'`{label}`' for label in each.labels)} | {each.meaning} |"
        for each in METRICS.values()
    ]
    written = [line for line in PAGE.read_text().splitlines() if line.startswith("| `m2pem.")]
    assert written == rows
