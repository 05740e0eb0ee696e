"""Checks a model for soundness with pm4py's Woflan: JSON in, JSON out.

Run by its own interpreter, which has pm4py and not m2pem.
"""

import json
import sys
import tempfile
import time
from pathlib import Path

import pm4py


def main() -> None:
    """Read, convert, check, and answer."""
    order = json.load(sys.stdin)
    with tempfile.TemporaryDirectory() as scratch:
        file = Path(scratch, "model.bpmn")
        file.write_text(order["xml"], encoding="utf-8")
        began = time.process_time(), time.perf_counter()
        net, initial, final = pm4py.convert_to_petri_net(pm4py.read_bpmn(str(file)))
        read_s = time.process_time() - began[0]
        found = pm4py.check_soundness(net, initial, final)
        cpu_s, wall_s = time.process_time() - began[0], time.perf_counter() - began[1]
    sound = found[0] if isinstance(found, tuple) else found
    figures = {"search_s": cpu_s - read_s, "all_s": cpu_s, "wall_s": wall_s}
    print(json.dumps({**figures, "verdict": "holds" if sound else "violated"}))


if __name__ == "__main__":
    main()
