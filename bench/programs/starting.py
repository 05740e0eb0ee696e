"""CPU seconds of commands, from the start of the process to its end.

python -m bench.programs.starting <times> [help]

`help`: of `m2pem --help` alone.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median

from bench.engines import REPOSITORY
from bench.graphs import instances

FIRST_START = ("LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE")
"""With the wheels of ROS, Python starts twice, unless it finds these of who starts it."""

FLEET = REPOSITORY / "fleet_configs" / "vignette1.yaml"


def children_s() -> float:
    """CPU seconds of all processes that were waited for."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def command_s(*arguments: str) -> float:
    """CPU seconds of a command of m2pem."""
    times = []
    environment = {name: os.environ[name] for name in os.environ if name not in FIRST_START}
    for _ in range(int(sys.argv[1])):
        before = children_s()
        subprocess.run(
            [sys.executable, "-m", "m2pem", *arguments],
            env=environment,
            check=True,
            stdout=subprocess.DEVNULL,
        )
        times.append(children_s() - before)
    return median(times)


def main() -> None:
    """Help, and what is done with a 20-element file."""
    if sys.argv[2:] == ["help"]:
        print(json.dumps({"help_s": command_s("--help")}))
        return
    with tempfile.TemporaryDirectory() as scratch:
        file = Path(scratch, "small.bpmn")
        file.write_bytes(instances(1).xml)
        figures = {
            "help_s": command_s("--help"),
            "check_s": command_s("check", str(file)),
            "check_fleet_s": command_s("check", str(file), "--fleet", str(FLEET)),
            "simulate_s": command_s("simulate", str(file)),
        }
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
