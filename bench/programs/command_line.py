"""Missions through `m2pem run`: reading, checking, execution and printing, without the start-up.

python -m bench.programs.command_line <tasks in a row> <branches> <times>

The start-up is the CPU time of the same command with a mission of one task.
"""

import json
import sys
import tempfile
from pathlib import Path

from bench.graphs import Graph, branches, row
from bench.programs.starting import command_s

FLEET = """\
version: 1
name: bench
origin: {lat: 38.0, lon: -77.0, alt: 0}
steps_between_waits: 1000000
vehicles:
  ugv1: {domain: ground, arbiter: sim}
"""


def run_s(graph: Graph, folder: Path, times: int) -> float:
    """Median of the CPU seconds of a run, from the start of the process to its end."""
    (folder / "bench.bpmn").write_bytes(graph.xml)
    data = [f"--data={name}={value}" for name, value in graph.given.items()]
    command = ["run", str(folder / "bench.bpmn"), "--fleet", str(folder / "fleet.yaml"), *data]
    return command_s(*command, "--ocu", "none", "--journal", "memory:", times=times)


def main() -> None:
    """Run both, and a small one beside each."""
    tasks, branch_count, times = map(int, sys.argv[1:])
    figures = {}
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        (folder / "fleet.yaml").write_text(FLEET)
        for name, make, size in ("row", row, tasks), ("branches", branches, branch_count):
            started_s = run_s(make(1), folder, times)
            figures[f"{name}_per_s"] = size / (run_s(make(size), folder, times) - started_s)
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
