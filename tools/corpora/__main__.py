"""`python -m tools.corpora FOLDER...`: what m2pem says of each model in the folders.

Prints the counts of each folder, and what m2pem did wrong; ends with 1 if that is anything.
`--every N` takes every Nth file, `--examples` prints a message of each rule with a file.
"""

import argparse
import sys
from pathlib import Path

from tools.corpora.examination import Examination
from tools.corpora.models import models
from tools.corpora.summary import Summary
from tools.corpora.workers import LIMIT_S, examine_all


def main() -> int:
    """Examine folders; the exit status."""
    parser = argparse.ArgumentParser(prog="python -m tools.corpora", description=__doc__)
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--every", type=int, default=1, help="take every Nth file")
    parser.add_argument("--limit", type=float, default=LIMIT_S, help="seconds for a file")
    parser.add_argument("--examples", action="store_true", help="print refusals with their files")
    options = parser.parse_args()
    wrong = False
    for folder in options.folders:
        summary = Summary()
        for path, found in examine_all(models(folder)[:: options.every], options.limit):
            summary.add(path, found)
            if options.examples:
                _show(path, found)
        print(f"== {folder}")
        print("\n".join(summary.lines()), flush=True)
        wrong = wrong or bool(summary.problems)
    return 1 if wrong else 0


def _show(path: Path, found: Examination) -> None:
    for rule, message in found.rules.items():
        print(f"{rule}: {message} <{path}>")


if __name__ == "__main__":
    sys.exit(main())
