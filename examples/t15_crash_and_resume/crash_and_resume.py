"""Kills an executive in the middle of a run, and has another take the run up."""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
M2PEM = [sys.executable, "-m", "m2pem"]


def start_and_kill(journal: Path) -> None:
    """Run the mission until the rover drives, then end the executive with SIGKILL."""
    command = [*M2PEM, "run", str(HERE / "mission.bpmn"), "--fleet", str(HERE / "fleet.yaml")]
    options = ["--simulate", "--speed", "50", "--ocu", "none", "--format", "json"]
    with subprocess.Popen(
        [*command, *options, "--journal", str(journal)], stdout=subprocess.PIPE, text=True
    ) as executive:
        assert executive.stdout is not None
        for line in executive.stdout:
            record = json.loads(line)
            if record["record"] == "BehaviorProgressed" and record["state"] == "RUNNING":
                break
        executive.kill()
    print("killed while the rover was driving")


def m2pem(*words: str) -> list[dict[str, object]]:
    """The records that a command prints."""
    done = subprocess.run(
        [*M2PEM, *words, "--format", "json"], stdout=subprocess.PIPE, text=True, check=True
    )
    return [json.loads(line) for line in done.stdout.splitlines()]


def main() -> None:
    """Crash, resume, and look at what the journal has of it."""
    with tempfile.TemporaryDirectory() as folder:
        journal = Path(folder) / "journal.db"
        start_and_kill(journal)
        m2pem("resume", "r1", "--journal", str(journal), "--ocu", "none")
        records = m2pem("replay", "r1", "--journal", str(journal))
    for record in records:
        if record["record"] in ("RunClaimed", "BehaviorRequested", "BehaviorEnded", "RunEnded"):
            words = ("record", "epoch", "element", "state", "outcome")
            print(*(record[word] for word in words if word in record))


if __name__ == "__main__":
    main()
