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


def command_s(*arguments: str, times: int) -> float:
    """Median of the CPU seconds of a command of m2pem that is called so many times."""
    taken = []
    environment = {name: os.environ[name] for name in os.environ if name not in FIRST_START}
    for _ in range(times):
        before = children_s()
        subprocess.run(
            [sys.executable, "-m", "m2pem", *arguments],
            env=environment,
            check=True,
            stdout=subprocess.DEVNULL,
        )
        taken.append(children_s() - before)
    return median(taken)


def main() -> None:
    """Help, and what is done with a 20-element file."""
    times = int(sys.argv[1])
    if sys.argv[2:] == ["help"]:
        print(json.dumps({"help_s": command_s("--help", times=times)}))
        return
    with tempfile.TemporaryDirectory() as scratch:
        file = Path(scratch, "small.bpmn")
        file.write_bytes(instances(1).xml)
        check = ("check", str(file))
        figures = {
            "help_s": command_s("--help", times=times),
            "check_s": command_s(*check, times=times),
            "check_fleet_s": command_s(*check, "--fleet", str(FLEET), times=times),
            "simulate_s": command_s("simulate", str(file), times=times),
        }
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
