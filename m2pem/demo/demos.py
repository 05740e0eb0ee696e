"""What each demonstration starts and runs: programs, so that no plugin is imported."""

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

from m2pem.demo.programs import Programs, copy_once, m2pem
from m2pem.demo.shipped_files import examples
from m2pem.errors import OperatorError
from m2pem.plugins import how_to_install

SIMULATED_SPEED = 20
AIR_SPEED = 10
SITL_SPEED = 5
"""How much faster than real ones vehicles are; real autopilots manage less."""
LINK_LOST = "1: cut link at 80 s for 600 s"
AUTOPILOT = (
    *("--ekf", "6s", "--set", "FS_GCS_ENABLE=1", "--set", "FS_GCS_TIMEOUT=10"),
    *("--set", "BATT_FS_LOW_ACT=2"),
)
FOLDER = Path(".demo")
"""Of the journal: the user's own, in which missions of their own are numbered, stays as it is."""
ROS_DOMAIN = 101
"""None of those that tests reserve, so that a demonstration meets no test."""
ROS_SPEED = 10
TEAM_WITHIN_S = 300
GATEWAY_VEHICLES = ("rover1", "rover2", "copter1", "copter2")


def vignette() -> int:
    """Run the paper's mission twice: a hazard is detected, and nothing is detected."""
    here = examples()
    answers = here / "missions/answers"
    # On a terminal only the detector is scripted, and the person there is the operator.
    live = sys.stdin.isatty() and sys.stdout.isatty()
    operator = "_live" if live else ""
    words = m2pem(
        *("run", here / "missions/vignette1.bpmn"),
        *("--fleet", here / "fleet_configs/vignette1.yaml"),
        *("--simulate", "--speed", str(SIMULATED_SPEED)),
        *("--journal", _journal(FOLDER)),
    )
    with Programs() as programs:
        _say(
            f"Two ways through one mission, {SIMULATED_SPEED} times as fast as real time.\n"
            "The first way: a hazard is detected. Continue; at the second prompt, abort."
        )
        if live:
            _wait_for_enter("Answer 1 (Continue), and 2 (Abort) when you are asked again.")
        detection = answers / f"vignette1_detection{operator}.yaml"
        status = programs.run([*words, "--answers", detection])
        if status == 0:
            _say(
                "\nThe second way: nothing is detected. Continue, and the route is driven"
                " to its end."
            )
            if live:
                _wait_for_enter("The same question comes on the same screen: answer 1.")
            status = programs.run(
                [*words, "--answers", answers / f"vignette1_route{operator}.yaml"]
            )
    return status


def air(ardupilot: Path | None = None) -> int:
    """Survey a field with two copters and a rover over MAVLink.

    `ardupilot`: a folder with real autopilots, which then simulate the vehicles. Without it, the
    autopilots are simulated, and the link to one of them is cut.
    """
    _needs("m2pem_plugin_mavlink", "m2pem-plugin-mavlink")
    here = examples()
    fleet = here / "fleet_configs/survey_pair.yaml"
    speed = SITL_SPEED if ardupilot else AIR_SPEED
    with Programs() as programs:
        if ardupilot:
            _say(
                f"Two ArduCopters and an ArduRover, {speed} times as fast as real ones, when they"
                " are ready."
            )
            words = m2pem("sitl", "--ardupilot", ardupilot, "--fleet", fleet, "--speed", str(speed))
            programs.start(words, ready="ready")
        else:
            _say(
                "Two copters and a rover over MAVLink, ten times as fast as real ones."
                " uav1 will fall silent."
            )
            words = m2pem("sim", "mavlink", "--copters", "2", "--rovers", "1", *AUTOPILOT)
            words += ["--home", "38.1075,-77.3192,60", "--fault", LINK_LOST, "--speed", str(speed)]
            programs.start(words)
        mission = here / "missions/survey_pair.bpmn"
        words = m2pem("run", mission, "--fleet", fleet, "--speed", str(speed))
        return programs.run([*words, "--journal", _journal(FOLDER)])


def web(folder: Path) -> int:
    """Serve the web page: draw, verify and run missions in a browser, on simulated vehicles.

    `folder`: of the missions and the journal; missions are copied there, so that what is drawn
    changes none of the installed ones.
    """
    _needs("m2pem_plugin_web", "m2pem-plugin-web")
    here = examples()
    copy_once(here / "missions/vignette1.bpmn", folder / "missions")
    _say("Open this address in a browser. Ctrl-C ends it.")
    with Programs({"M2PEM_WEB_MISSIONS": str(folder / "missions")}) as programs:
        fleet = here / "fleet_configs/vignette1.yaml"
        words = m2pem("serve", "--fleet", fleet, "--simulate", "--ocu", "web")
        return programs.run([*words, "--journal", folder / "journal.db"])


def ros_vehicle(domain: int = ROS_DOMAIN) -> int:
    """Run the paper's mission on a ground vehicle with an m2pem node, with an operator over ROS."""
    _say(
        f"A ground vehicle with an m2pem node, {ROS_SPEED} times as fast as a real one. Its radar"
        " finds a mine:\ncontinue; at the second prompt, abort. Then once more: nothing is left to"
        " be found, and the route is driven."
    )
    runs = {"vignette1_detection": "vignette1", "vignette1_route": "vignette1"}
    return _over_ros("vignette1_ros.yaml", runs, domain)


def ros_team(domain: int = ROS_DOMAIN) -> int:
    """Sweep a road with three ground vehicles, reached in three ways over ROS."""
    _say(
        "Three vehicles, reached in three ways, sweep a road as a team; one finds a mine, and they"
        " cross the bridge."
    )
    return _over_ros("mehds_ros.yaml", {"mehds_vignette_1_swept": "mehds_vignette_1"}, domain)


def gateway(domain: int = ROS_DOMAIN, vehicles_port: int = 14540, port: int = 14550) -> int:
    """Show two ROS rovers and two MAVLink copters to a ROS client and to a ground station.

    `vehicles_port`: where autopilots send to. `port`: where ground stations listen.
    """
    _needs("m2pem_plugin_mavlink", "m2pem-plugin-mavlink[mavsdk]")
    _needs("mavsdk", "m2pem-plugin-mavlink[mavsdk]")
    here = examples()
    written = (here / "fleet_configs/gateway.yaml").read_text(encoding="utf-8")
    written = written.replace("127.0.0.1:14540", f"127.0.0.1:{vehicles_port}")
    written = written.replace("127.0.0.1:14550", f"127.0.0.1:{port}")
    programs = here / "examples/t24_gateway"
    with TemporaryDirectory() as folder, Programs(_loopback(domain)) as vehicles:
        fleet, refusing = Path(folder) / "gateway.yaml", Path(folder) / "refusing.yaml"
        fleet.write_text(written, encoding="utf-8")
        refusing.write_text(written.replace("commands: [rover1]", "commands: none"), "utf-8")
        _say("Two rovers over ROS 2 and two copters over MAVLink, as fast as real ones.")
        vehicles.start(m2pem("sim", "ros", "--fleet", fleet), ready="ready")
        words = m2pem("sim", "mavlink", "--copters", "2", *AUTOPILOT)
        words += ["--home", "38.1075,-77.3192,60", "--to", f"udp://127.0.0.1:{vehicles_port}"]
        vehicles.start(words)
        station = [sys.executable, str(programs / "ground_station.py"), "--port", str(port)]
        with Programs(_loopback(domain)) as served:
            served.start(m2pem("gateway", "--fleet", refusing, "--journal", "memory:"))
            _say("\nA ROS client sees all four, and sends a MAVLink copter somewhere.")
            client = [sys.executable, str(programs / "ros_client.py"), *GATEWAY_VEHICLES]
            if status := served.run([*client, "--fly", "copter1"]):
                return status
            _say("\nA ground station sees all four. It may not command rover1, a ROS vehicle.")
            if status := served.run([*station, "--drive", "11", "--refused"]):
                return status
        with Programs(_loopback(domain)) as served:
            _say("\nThe same with a fleet file that allows it.")
            served.start(m2pem("gateway", "--fleet", fleet, "--journal", "memory:"))
            return served.run([*station, "--drive", "11"])


def _over_ros(fleet_name: str, runs: Mapping[str, str], domain: int) -> int:
    """Serve an operator over ROS who starts each mission with its answers: {answers: mission}."""
    here = examples()
    fleet = here / "fleet_configs" / fleet_name
    with Programs(_loopback(domain)) as programs:
        speed = ("--speed", str(ROS_SPEED))
        programs.start(m2pem("sim", "ros", "--fleet", fleet, *speed), ready="ready")
        serve = m2pem("serve", "--fleet", fleet, "--ocu", "mocu", *speed, "--journal", "memory:")
        programs.start(serve, quiet=True)
        for answers, mission in runs.items():
            status = programs.run(
                _operator(here / f"missions/{mission}.bpmn", _answers(here, answers))
            )
            if status:
                return status
    return 0


def team(
    domain: int = ROS_DOMAIN,
    *,
    fleet: Path | None = None,
    ardupilot: Path | None = None,
    port: int = 14550,
    answers: Path | None = None,
    pointing_deg: float = 1.0,
    reached: str = "EndBypassed",
) -> int:
    """March in a column with a camera and a copter, over ROS 2 and MAVLink, and measure how well.

    `ardupilot`: a folder with real autopilots; without it the copter's autopilot is simulated and
    sends to `port` of this machine. `pointing_deg`: the largest error of the camera; `reached`: the
    end event that the run must come to. A clone measures both, an installed package does not.
    Vehicles are as fast as real ones: how quickly a camera is commanded is a matter of real time.
    """
    _needs("m2pem_plugin_mavlink", "m2pem-plugin-mavlink")
    _needs("m2pem_plugin_ptz", "m2pem-plugin-ptz")
    _say(
        "Three ROS vehicles march in a column. The camera on the last one scans, a copter follows"
        " over MAVLink; the\nradar on the first one finds a mine. It takes less than two minutes."
    )
    here = examples()
    fleet = fleet or here / "fleet_configs/mehds_mixed.yaml"
    where, speed = ("--fleet", fleet), ("--speed", "1")
    paths = [str(here), *filter(None, [os.environ.get("PYTHONPATH")])]
    variables = {**_loopback(domain), "PYTHONPATH": os.pathsep.join(paths)}
    with Programs(variables) as programs:
        if ardupilot:
            words = m2pem("sitl", "--ardupilot", ardupilot, *where, *speed)
            programs.start(words, ready="ready")
        else:
            words = m2pem("sim", "mavlink", "--copters", "1", *AUTOPILOT, *speed)
            words += ["--home", "38.107162,-77.319941,60", "--to", f"udp://127.0.0.1:{port}"]
            programs.start([*words, "--set", "LAND_SPEED=100", "--set", "WPNAV_SPEED_DN=250"])
        programs.start(m2pem("sim", "ros", *where, *speed), ready="ready")
        programs.start(m2pem("sim", "ros-cameras", *where, *speed), ready="ready")
        programs.start(
            m2pem("serve", *where, "--ocu", "mocu", *speed, "--journal", "memory:"), quiet=True
        )
        measured = None
        if (here / "bench/column").is_dir():
            watch = [sys.executable, "-m", "bench.column", "--fleet", str(fleet), *speed]
            watch += ["--team", "camera_last", "--camera", "evsg2/ptz"]
            watch += ["--bound", str(pointing_deg), "--reached", reached]
            measured = programs.collect(watch, ready="watching")
        operator = _operator(
            here / "missions/team_column.bpmn", answers or _answers(here, "team_column_bypassed")
        )
        status = programs.run([*operator, "--within", str(TEAM_WITHIN_S)])
        if status == 0 and measured is not None:
            status = measured.finish()
    return status


def _wait_for_enter(text: str) -> None:
    """Let a person read what is printed, before a screen covers it."""
    _say(f"{text}\nPress Enter to begin, Ctrl-C to end.")
    sys.stdin.readline()


def _journal(folder: Path) -> Path:
    """The journal of demonstrations in a folder, which is made; says where it is.

    Raises:
        OperatorError: the folder cannot be made.
    """
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise OperatorError(
            f"{folder.absolute()}, the folder of the journal, cannot be made: {error.strerror}; "
            "run the demonstration in a folder of yours"
        ) from error
    journal = folder / "journal.db"
    _say(f"The journal is {journal}: `m2pem runs --journal {journal}` lists its runs.")
    return journal


def _operator(mission: Path, answers: Path) -> list[str]:
    """The operator of the example, who starts a mission over ROS and answers its prompts."""
    program = examples() / "examples/t22_operator_over_ros/ros_operator.py"
    return [sys.executable, str(program), "--mission", str(mission), "--answers", str(answers)]


def _answers(here: Path, name: str) -> Path:
    return here / f"missions/answers/{name}.yaml"


def _loopback(domain: int) -> Mapping[str, str]:
    """The environment that keeps DDS on 127.0.0.1. Without it DDS uses every network."""
    _needs("m2pem_plugin_ros", "m2pem-plugin-ros[wheels]")
    _needs("m2pem_plugin_mocu", "m2pem-plugin-mocu")
    code = "import json; from m2pem_plugin_ros.loopback import environment; "
    code += f"print(json.dumps(dict(environment({domain}))))"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    variables: dict[str, str] = json.loads(done.stdout)
    return variables


def _needs(module: str, distribution: str) -> None:
    if find_spec(module) is None:
        raise OperatorError(f"this demonstration needs a plugin: {how_to_install(distribution)}")


def _say(text: str) -> None:
    print(text, flush=True)
