"""What m2pem does in each case: more is compared than of others, the order too, and each `at:`."""

from collections.abc import Iterable

from tests.cases import Case
from tests.cases.playing import differences
from tools.conformance.verdict import Verdict


def verdicts(cases: Iterable[Case]) -> list[Verdict]:
    return [_verdict(case) for case in cases]


def _verdict(case: Case) -> Verdict:
    found = differences(case)
    wrong = next((line for line in found.splitlines() if line.startswith("  !")), found)
    return Verdict("differs", wrong.strip(" !")) if found else Verdict("same")
