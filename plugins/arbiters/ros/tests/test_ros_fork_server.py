import json
import signal
import subprocess
from pathlib import Path

import pytest
from m2pem_plugin_ros.fork_server import PRELOADED, ForkServer, fork_server

TELLS = """
import json, os, sys
from pathlib import Path
status = Path("/proc/self/status").read_text().splitlines()
print(json.dumps({
    "name": __name__,
    "arguments": sys.argv,
    "path": sys.path[0],
    "folder": os.getcwd(),
    "environment": dict(os.environ),
    "pid": os.getpid(),
    "threads": next(line.split()[1] for line in status if line.startswith("Threads:")),
    "descriptors": sorted(os.listdir("/proc/self/fd"), key=int),
    "modules": list(sys.modules),
}), flush=True)
for line in sys.stdin:
    print("heard", line, end="", flush=True)
sys.exit(7)
"""


@pytest.fixture
def program(tmp_path: Path) -> Path:
    path = tmp_path / "program.py"
    path.write_text(TELLS, encoding="utf-8")
    return path


def test_a_program_runs_as_python_would_run_it_with_its_modules_imported(
    program, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    environment = {"ROS_DOMAIN_ID": "7", "WHAT": "ümlaut"}
    # One that runs beside it, whose pipes are none of its own.
    other = fork_server().start(program, writes=True)
    started = fork_server().start(program, ["--a", "b c"], environment, writes=True)
    told = json.loads(started.stdout.readline())
    assert told["name"] == "__main__"
    assert told["arguments"] == [str(program), "--a", "b c"]
    assert told["path"] == told["folder"] == str(tmp_path)
    assert told["environment"] == environment
    assert told["pid"] == started.pid
    assert told["threads"] == "1"
    assert told["descriptors"] == ["0", "1", "2", "3"]  # the last: of the folder that it lists
    assert set(PRELOADED) <= set(told["modules"])
    started.stdin.write("this\n")
    started.stdin.flush()
    assert started.stdout.readline() == "heard this\n"
    assert started.poll() is None
    started.stdin.close()
    assert started.wait(30) == started.poll() == 7
    other.kill()
    assert other.wait(30) == -signal.SIGKILL


def test_whoever_does_not_end_is_waited_for_no_longer_than_said(program):
    started = fork_server().start(program, writes=True)
    with pytest.raises(subprocess.TimeoutExpired):
        started.wait(0.0)
    started.send_signal(signal.SIGTERM)
    assert started.wait(30) == -signal.SIGTERM
    started.kill()


def test_without_its_server_nothing_is_started(program):
    server = ForkServer()
    server.close()
    with pytest.raises(RuntimeError, match="the fork server has ended"):
        server.start(program)
