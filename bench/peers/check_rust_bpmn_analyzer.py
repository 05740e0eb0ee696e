"""Checks a model with rust_bpmn_analyzer: JSON in, JSON out.

python bench/peers/check_rust_bpmn_analyzer.py <program> [--por]
"""

import json
import re
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PROPERTIES = "safeness,option-to-complete,proper-completion,no-dead-activities"
COLOUR = re.compile(r"\x1b\[[0-9;]*m")
TOOK = re.compile(r"successful in ([0-9.]+)(s|ms|µs|ns)")
STATES = re.compile(r"States: (\d+)")
UNITS_S = {"s": 1.0, "ms": 1e-3, "µs": 1e-6, "ns": 1e-9}


def main() -> None:
    """Run it, and read what it prints."""
    order = json.load(sys.stdin)
    with tempfile.TemporaryDirectory() as scratch:
        file = Path(scratch, "model.bpmn")
        file.write_text(order["xml"], encoding="utf-8")
        command = [sys.argv[1], "-f", str(file), "-p", PROPERTIES, *sys.argv[2:]]
        began = time.perf_counter()
        done = subprocess.run(
            command, capture_output=True, text=True, check=True, timeout=order["limit_s"]
        )
        wall_s = time.perf_counter() - began
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu_s = used.ru_utime + used.ru_stime
    text = COLOUR.sub("", done.stdout)
    took, states = TOOK.search(text), STATES.search(text)
    if took is None or states is None:
        raise ValueError(f"it says something else than expected: {text[:200]}")
    said_s = float(took[1]) * UNITS_S[took[2]]
    verdict = "violated" if "not fulfilled" in text else "holds"
    # It tells real time, of which another program may have had a part.
    figures = {"search_s": min(said_s, cpu_s), "all_s": cpu_s, "wall_s": wall_s}
    print(json.dumps({**figures, "states": int(states[1]), "verdict": verdict}))


if __name__ == "__main__":
    main()
