"""`python -m tools.corpora_verification FOLDER...`: checks each model in the folders within limits.

Prints how many were decided, left undecided, refused and crashed, and what they took; ends with 1
if any crashed or took too much. `--jsonl FILE` writes a line for each file.
"""

import argparse
import json
import sys
from contextlib import nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import TextIO

from tools.corpora.models import models
from tools.corpora_verification.counting import Counts
from tools.corpora_verification.judging import Terms
from tools.corpora_verification.measuring import Measured, measure_all


def main() -> int:
    """Check folders; the exit status."""
    program = "python -m tools.corpora_verification"
    parser = argparse.ArgumentParser(prog=program, description=__doc__)
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--seconds", type=float, default=2.0, help="for a file")
    parser.add_argument("--memory", type=float, default=500.0, help="MB for a file")
    parser.add_argument("--every", type=int, default=1, help="take every Nth file")
    parser.add_argument("--as-drawn", action="store_true", help="exactly as m2pem verify")
    parser.add_argument("--closed", action="store_true", help="messages come from within only")
    parser.add_argument("--jsonl", type=Path, help="write a line for each file")
    options = parser.parse_args()
    terms = Terms(options.seconds, options.memory, options.as_drawn, not options.closed)
    counts = Counts(terms)
    lines = options.jsonl.open("w", encoding="utf-8") if options.jsonl else nullcontext()
    with lines as stream:
        _check(options, terms, counts, stream)
    print("\n".join(counts.lines()))
    return 1 if counts.wrong else 0


def _check(
    options: argparse.Namespace, terms: Terms, counts: Counts, stream: TextIO | None
) -> None:
    for folder in options.folders:
        paths = models(folder)[:: options.every]
        for found in measure_all(paths, terms):
            counts.add(found)
            if stream is not None:
                stream.write(_line(found, folder))
                stream.flush()


def _line(found: Measured, folder: Path) -> str:
    said = asdict(found)
    said["path"] = str(found.path.relative_to(folder))
    return json.dumps(said, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    sys.exit(main())
