"""The conformance cases: what BPMN 2.0 says an element does, as data (tests/data/README.md)."""

from tests.cases.case import ENDS, Case, Expected, Step
from tests.cases.reading import DATA, CaseError, read_cases, read_topic
from tests.cases.when import When

__all__ = [
    "DATA",
    "ENDS",
    "Case",
    "CaseError",
    "Expected",
    "Step",
    "When",
    "read_cases",
    "read_topic",
]
