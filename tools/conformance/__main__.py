"""`python -m tools.conformance`: play each case with each engine; print and write the tables.

`make conformance` installs the other engines first.
"""

import argparse
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from tests.cases import Case, read_cases
from tools.conformance import own
from tools.conformance.peers import REPOSITORY, Peer, bpmn_elements, spiffworkflow
from tools.conformance.table import PAGE, RESULTS, details, summary, write
from tools.conformance.verdict import Verdict, judge, not_asked

AT_ONCE = 2


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tools.conformance", description=__doc__)
    parser.add_argument(
        "--spiffworkflow",
        type=Path,
        default=REPOSITORY / ".conformance" / "bin" / "python",
        metavar="PYTHON",
        help="an interpreter that has SpiffWorkflow",
    )
    parser.add_argument("--only", default="", help="cases whose file's name has this; no page")
    asked = parser.parse_args()
    cases = [case for case in read_cases() if asked.only in case.file.stem]
    verdicts = {"m2pem": own.verdicts(cases)}
    modules = REPOSITORY / "tests" / "js" / "node_modules"
    for peer in (spiffworkflow(asked.spiffworkflow), bpmn_elements(modules)):
        verdicts[f"{peer.name} {peer.version}"] = ask(peer, cases)
    table = details(cases, verdicts)
    print(table)
    if not asked.only:
        RESULTS.write_text(table, encoding="utf-8")
        page = write(PAGE.read_text(encoding="utf-8"), summary(cases, verdicts))
        PAGE.write_text(page, encoding="utf-8")
    return 0


def ask(peer: Peer, cases: Sequence[Case]) -> list[Verdict]:
    """What the engine does in each case that does not need an extension of m2pem."""

    def one(case: Case) -> Verdict:
        return Verdict("n.a.") if not_asked(case) else judge(case, peer.play(case))

    with ThreadPoolExecutor(AT_ONCE) as pool:
        return list(pool.map(one, cases))


if __name__ == "__main__":
    sys.exit(main())
