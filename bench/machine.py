"""What a measurement was made on and with."""

import json
import os
import platform
import subprocess
from pathlib import Path

import m2pem


def machine(python: Path, modules: Path, ros: Path) -> dict[str, str]:
    """The processor, the system and the versions."""
    found = {
        "processor": _processor(),
        "cores": str(os.cpu_count()),
        "memory": f"{os.sysconf('SC_PAGE_SIZE') * os.sysconf('SC_PHYS_PAGES') / 2**30:.0f} GiB",
        "system": f"{platform.system()} {platform.release()}",
        "load before": f"{os.getloadavg()[0]:.1f}",
        "Python": platform.python_version(),
        "m2pem": m2pem.__version__,
    }
    ask = "from importlib.metadata import version; print(version('SpiffWorkflow'))"
    found["SpiffWorkflow"] = _said(str(python), "-c", ask)
    ask = "from importlib.metadata import version; print(version('ros-rclpy'))"
    found["rclpy"] = _said(str(ros), "-c", ask)
    found["Node.js"] = _said("node", "--version")
    for name in ("bpmn-elements", "bpmn-engine"):
        package = modules / name / "package.json"
        text = package.read_text(encoding="utf-8") if package.exists() else "{}"
        found[name] = json.loads(text).get("version", "")
    return {name: value for name, value in found.items() if value}


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    named = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return named[0] if named else platform.machine()


def _said(*command: str) -> str:
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except OSError:
        return ""
    return done.stdout.strip()
