"""The script of docs/web.md, by curl, against a page that a process serves."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

from web_served import REPOSITORY, served

from m2pem.testing import scenarios


def test_the_script_of_the_docs_lists_runs_and_stops_them(tmp_path: Path) -> None:
    page = (REPOSITORY / "docs" / "web.md").read_text(encoding="utf-8")
    (script,) = re.findall(r"^```sh\n(.*?)^```", page, re.M | re.S)
    own = {
        "XDG_STATE_HOME": str(tmp_path),
        "XDG_RUNTIME_DIR": "",
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
    }
    start = """curl --silent --show-error --cookie jar --header "M2pem-Key: $key" \\
      --header "Origin: $base" --json '{"mission": "ask"}' "$base/api/runs"\n"""
    listed = 'curl --cookie jar --header "M2pem-Key: $key" "$base/api/runs"\n'
    first, then = script.split(listed)
    with served(tmp_path, environment=own) as page_served:
        (page_served.missions / "ask.bpmn").write_bytes(scenarios.question("Go on?"))
        done = subprocess.run(
            ["sh", "-ec", "\necho\n".join([first + start, listed, then])],
            cwd=tmp_path,
            env={**os.environ, **own},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        started, runs, stopped = (json.loads(line) for line in done.stdout.split("\n") if line)
    assert started["run"] == "r1"
    assert [each["run"] for each in runs] == ["r1"]
    assert stopped == {"runs": ["r1"]}
