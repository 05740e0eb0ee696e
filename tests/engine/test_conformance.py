"""The table of docs/bpmn-support.md says of m2pem what the cases show."""

from tests.cases import read_cases
from tools.conformance.own import verdicts
from tools.conformance.table import PAGE, own_column, read_own_column


def test_the_page_has_every_case_and_what_m2pem_does_in_it() -> None:
    cases = read_cases()
    assert read_own_column(PAGE.read_text(encoding="utf-8")) == own_column(
        cases, verdicts(cases)
    ), "the cases have changed: run `make conformance`"
