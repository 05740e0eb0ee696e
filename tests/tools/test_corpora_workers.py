"""A file that breaks the interpreter, or never ends, is named, and the others are examined."""

import os
import time
from pathlib import Path

from tools.corpora.examination import Examination, Outcome
from tools.corpora.workers import examine_all

FINE = Examination(Outcome.LOADED, ends=("completed",))


def examine_badly(path: Path) -> Examination:
    """Do what the file's name says."""
    if path.name == "crash":
        os.abort()
    while path.name == "hang":
        time.sleep(60)
    return FINE


def test_a_crash_and_a_hang_cost_one_file_each() -> None:
    paths = [Path(name) for name in ("one", "crash", "two", "hang", "three")]
    found = dict(examine_all(paths, 2.0, examine_badly))
    assert list(found) == paths
    assert [path.name for path, each in found.items() if each == FINE] == ["one", "two", "three"]
    assert "crashes" in found[Path("crash")].problems[0]
    assert "hangs" in found[Path("hang")].problems[0]
