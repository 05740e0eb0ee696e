"""The table of docs/bpmn-support.md has every case, and m2pem does in each what BPMN says."""

import pytest

from tests.cases import read_cases
from tools.conformance.own import verdicts
from tools.conformance.table import PAGE, names, read_names


@pytest.mark.tried_with(
    "SpiffWorkflow",
    "executes the cases of [BPMN support](bpmn-support.md)",
    kind="BPMN engines",
    result="the page counts where it does as BPMN says",
    needs="`make conformance`",
    on="2026-11",
)
@pytest.mark.tried_with(
    "bpmn-elements",
    "executes the cases of [BPMN support](bpmn-support.md)",
    kind="BPMN engines",
    result="the page counts where it does as BPMN says",
    needs="`make conformance`",
    on="2026-11",
)
def test_the_page_has_every_case() -> None:
    assert read_names(PAGE.read_text(encoding="utf-8")) == names(read_cases()), (
        "the cases have changed: run `make conformance`"
    )


def test_m2pem_does_what_bpmn_says_in_each_case() -> None:
    cases = read_cases()
    wrong = [
        (case.file.name, verdict.words)
        for case, verdict in zip(cases, verdicts(cases), strict=True)
        if verdict.kind != "same"
    ]
    assert not wrong
