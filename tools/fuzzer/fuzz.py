"""`python -m tools.fuzzer.fuzz --seconds 600 [FOLDER...]`: strange files, until the time is up.

Each case is a number: it chooses a mutation of sound files, and what happens to the run of what
still loads. A case that breaks m2pem is kept as a file, and named; `--case N` plays it again.
"""

import argparse
import faulthandler
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from random import Random

from m2pem.bpmn import parse_mission
from m2pem.errors import FleetError, MissionError
from m2pem.executive.loading import findings_for
from m2pem.findings import has_errors
from m2pem.fleet.default_fleet import fleet_for
from m2pem.mission.mission import Mission
from m2pem.rehearsal.rehearsal import rehearse
from tests.engine.kit import Play
from tests.engine.random_play import RandomPlay
from tools.corpora.examination import plugins
from tools.corpora.flaws import flaws
from tools.corpora.models import models
from tools.fuzzer.mutation import mutate

ROOT = Path(__file__).parents[2]
OWN = ("tests/data", "missions", "examples")
MAX_SEED_BYTES = 100_000
HANG_S = 120
"""A case that takes longer is taken for a hang: the interpreter says where it is, and ends."""

MAX_STEPS = 300
MAX_INPUTS = 25
MAX_NODES_PLAYED = 300
"""A larger mission is only rehearsed: checking the whole state after each input takes too long."""

NAME = "fuzz.bpmn"


def seeds(folders: Sequence[Path] = ()) -> list[bytes]:
    """Sound files: those of the project, and those of the folders that are no monsters."""
    found = [path.read_bytes() for name in OWN for path in models(ROOT / name)]
    for path in (path for folder in folders for path in models(folder)):
        data = path.read_bytes()
        if len(data) <= MAX_SEED_BYTES:
            try:
                parse_mission(data, path.name)
            except MissionError:
                continue
            found.append(data)
    return found


def case(number: int, sound: list[bytes]) -> bytes:
    """The file of a case."""
    return mutate(sound, Random(number))


def survive(data: bytes, number: int) -> str:
    """Read a file and run what loads. Gives back what became of it; raises if m2pem is at fault."""
    try:
        mission = parse_mission(data, NAME)
    except MissionError as error:
        assert has_errors(error.findings), "refused without an error"
        wrong = list(flaws(data, NAME, error.findings))
        assert not wrong, "\n".join(wrong)
        return "refused"
    wrong = list(flaws(data, NAME, findings_for(mission, None, plugins())))
    assert not wrong, "\n".join(wrong)
    dice = Random(number)
    if not _rehearsed(mission, dice):
        return "refused with its fleet"
    if len(mission.nodes) <= MAX_NODES_PLAYED:
        _play(mission, dice)
    return "run"


def _rehearsed(mission: Mission, dice: Random) -> bool:
    process = dice.choice(mission.processes).id
    try:
        result = rehearse(
            mission,
            fleet_for(mission),
            plugins=plugins(),
            process=process,
            data={"a": 1, "b": 1},
            max_steps=MAX_STEPS,
        )
    except (MissionError, FleetError) as error:
        assert has_errors(error.findings)
        return False
    assert result.summary.records == len(result.records)
    return True


def _play(mission: Mission, dice: Random) -> None:
    """What could happen outside, happens; then the journal alone rebuilds the state."""
    Play.made.clear()
    game = RandomPlay(mission, dice.choice((1, 5, 50)))
    game.go([dice.randrange(10_000) for _ in range(dice.randrange(MAX_INPUTS))])
    game.finish()
    game.end()
    game.play.verify()


def main() -> int:
    """Play cases until the time is up; the exit status."""
    parser = argparse.ArgumentParser(prog="python -m tools.fuzzer.fuzz", description=__doc__)
    parser.add_argument("folders", nargs="*", type=Path, help="more sound files")
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--first", type=int, default=0, help="the number of the first case")
    parser.add_argument("--case", type=int, help="play this case alone, and keep its file")
    options = parser.parse_args()
    keep = Path(tempfile.mkdtemp(prefix="m2pem-fuzz-"))
    sound = seeds(options.folders)
    print(f"{len(sound)} sound files; cases that break m2pem are kept in {keep}", flush=True)
    outcomes: Counter[str] = Counter()
    ends_at = time.monotonic() + options.seconds
    number = options.first if options.case is None else options.case
    while time.monotonic() < ends_at:
        outcomes[_one(number, sound, keep)] += 1
        if options.case is not None:
            break
        number += 1
    print(f"cases {options.first} to {number - 1}: {dict(outcomes)}")
    return 1 if outcomes["BROKEN"] else 0


def _one(number: int, sound: list[bytes], keep: Path) -> str:
    file = keep / f"{number}.bpmn"
    file.write_bytes(b"")
    faulthandler.dump_traceback_later(HANG_S, exit=True)
    try:
        data = case(number, sound)
        file.write_bytes(data)
        outcome = survive(data, number)
    except Exception:
        print(f"case {number}, {file}:\n{traceback.format_exc(chain=False)[-3000:]}", flush=True)
        return "BROKEN"
    finally:
        faulthandler.cancel_dump_traceback_later()
    file.unlink()
    return outcome


if __name__ == "__main__":
    sys.exit(main())
