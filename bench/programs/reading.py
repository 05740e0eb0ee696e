"""Reading and checking a file of so many script tasks in a row, as `m2pem check` does.

python -m bench.programs.reading <tasks>
"""

import json
import sys

from bench.graphs import row
from bench.measured import Stopwatch, again_and_again, peak_kb
from m2pem.executive.loading import findings_for, load_source
from m2pem.plugins import PluginManager


def main() -> None:
    """Read, check, count."""
    size = int(sys.argv[1])
    source = row(size - 2).xml
    plugins = PluginManager()
    # Loading the plugins belongs to the start of a process, not to a file.
    findings_for(load_source(row(1).xml), None, plugins, ["n"])

    def read() -> tuple[float, int]:
        watch = Stopwatch()
        with watch:
            mission = load_source(source)
            findings = findings_for(mission, None, plugins, ["n"])
        assert not findings, findings[0]
        return watch.cpu_s, len(list(mission.activities()))

    cpu_s, tasks = again_and_again(read)
    assert tasks == size - 2, tasks
    print(json.dumps({"cpu_s": cpu_s, "us_per_element": cpu_s / size * 1e6, "peak_kb": peak_kb()}))


if __name__ == "__main__":
    main()
