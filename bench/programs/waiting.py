"""The memory of instances of a 20-element process that wait at a user task.

python -m bench.programs.waiting <instances>
"""

import gc
import json
import sys
from pathlib import Path

from bench.graphs import document, path
from m2pem.bpmn import parse_mission
from m2pem.engine.inputs import StartRun
from m2pem.engine.run import MissionRun

PAGE = 4096


def resident_bytes() -> int:
    """Memory of this process now (Linux)."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * PAGE


def main() -> None:
    """Begin them, keep them, and weigh them."""
    count = int(sys.argv[1])
    names = [f"t{number}" for number in range(17)]
    tasks = [(name, "n") for name in names]
    nodes = [("start", "startEvent"), *tasks[:8], ("ask", "userTask"), *tasks[8:]]
    source = document(
        [*nodes, ("end", "endEvent")], path("start", *names[:8], "ask", *names[8:], "end")
    )
    mission = parse_mission(source, "bench.bpmn")
    given = StartRun("BENCH", {"n": 0})
    MissionRun(mission, None, "r0").receive(given, 0)
    gc.collect()
    before = resident_bytes()
    runs = []
    for number in range(count):
        run = MissionRun(mission, None, f"r{number + 1}")
        run.receive(given, 0)
        runs.append(run)
    gc.collect()
    each = (resident_bytes() - before) / count
    assert all(len(run.state.prompts) == 1 for run in runs)
    print(json.dumps({"bytes": each}))


if __name__ == "__main__":
    main()
