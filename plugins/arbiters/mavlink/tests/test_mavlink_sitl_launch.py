"""With which words `m2pem sitl` starts the programs of autopilots, and what it refuses."""

import json
from pathlib import Path
from typing import Any

import pytest
from m2pem_plugin_mavlink.sitl.fleet import launches, read_vehicles
from m2pem_plugin_mavlink.sitl.launch import Launch
from m2pem_plugin_mavlink.sitl.programs import SitlError

from m2pem import load_fleet
from m2pem.errors import PluginError

URL = "udpin://127.0.0.1:14550"


@pytest.fixture
def ardupilot(tmp_path: Path) -> Path:
    """A source tree, as far as it is looked at."""
    tree = tmp_path / "ardupilot"
    for name in ("arducopter", "ardurover", "arduplane"):
        touched(tree / "build/sitl/bin" / name)
    for name in ("default_params/copter", "default_params/rover", "default_params/motorboat"):
        touched(tree / f"Tools/autotest/{name}.parm", f"# {Path(name).name}\n")
    return tree


@pytest.fixture
def px4(tmp_path: Path) -> Path:
    folder = tmp_path / "px4"
    touched(folder / "bin/px4")
    for name in ("10040_sihsim_quadx", "10040_sihsim_quadx.post", "10041_sihsim_airplane"):
        touched(folder / "etc/init.d-posix/airframes" / name)
    return folder


def touched(file: Path, text: str = "") -> Path:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
    return file


def vehicle(
    domain: str = "air", system_id: int = 1, url: object = URL, **more: object
) -> dict[str, Any]:
    keys = ("sitl", "gcs_system_id", "component_id")
    connection = {key: more.pop(key) for key in keys if key in more}
    connection |= {"url": url, "system_id": system_id}
    return {
        **{"domain": domain, "arbiter": "mavlink", "connection": connection, "sitl": True},
        **more,
    }


def started(
    tmp_path: Path,
    ardupilot: Path | None,
    px4: Path | None = None,
    speed: float = 5.0,
    **vehicles: dict[str, Any],
) -> list[Launch]:
    file = tmp_path / "fleet.yaml"
    origin = {"lat": 38.1, "lon": -77.3, "alt": 60.0}
    fleet = {"version": 1, "origin": origin, "vehicles": vehicles}
    file.write_text(json.dumps(fleet), encoding="utf-8")
    found = read_vehicles(load_fleet(file), speed)
    return list(launches(found, ardupilot, px4, tmp_path / "runs"))


def option(launch: Launch, name: str) -> str:
    return launch.command[launch.command.index(name) + 1]


def test_a_copter_sends_to_the_port_of_its_url_and_waits_for_no_connection(
    tmp_path: Path, ardupilot: Path
) -> None:
    (launch,) = started(tmp_path, ardupilot, uav1=vehicle(system_id=7))
    assert launch.name == "uav1"
    assert launch.command[0] == str(ardupilot / "build/sitl/bin/arducopter")
    assert option(launch, "--model") == "quad"
    assert option(launch, "--sysid") == "7"
    assert option(launch, "--speedup") == "5"
    assert option(launch, "--home") == "38.1,-77.3,60,0"
    assert option(launch, "--serial0") == "udpclient:127.0.0.1:14550"
    for serial in (1, 2, 5, 6, 7, 8):
        assert option(launch, f"--serial{serial}") == f"none:{serial}"
    assert launch.files == {"copter.parm": "# copter\n"}
    assert option(launch, "--defaults") == "copter.parm"


def test_vehicles_have_instances_of_their_own_and_stand_in_a_row(
    tmp_path: Path, ardupilot: Path
) -> None:
    on_land, at_sea = vehicle("ground", 2), vehicle("surface", 3)
    uav1, r1, b1 = started(tmp_path, ardupilot, uav1=vehicle(), r1=on_land, b1=at_sea)
    assert [next(w for w in each.command if w.startswith("-I")) for each in (uav1, r1, b1)] == [
        "-I0",
        "-I1",
        "-I2",
    ]
    assert [option(each, "--model") for each in (uav1, r1, b1)] == ["quad", "rover", "motorboat"]
    assert option(b1, "--defaults") == "rover.parm,motorboat.parm"
    homes = [option(each, "--home").split(",") for each in (uav1, r1, b1)]
    longitudes = [float(each[1]) for each in homes]
    assert longitudes == sorted(longitudes)
    assert len(set(longitudes)) == 3


def test_the_fleet_says_where_it_stands_what_it_is_and_its_parameters(
    tmp_path: Path, ardupilot: Path
) -> None:
    touched(ardupilot / "Tools/autotest/models/plane.parm")
    said = {
        "frame": "plane",
        "home": [38.2, -77.4],
        "heading": "60 deg",
        "parameters": {"BATT_FS_LOW_ACT": 2},
    }
    (launch,) = started(tmp_path, ardupilot, uav1=vehicle(sitl=said))
    assert launch.command[0].endswith("arduplane")
    assert option(launch, "--home") == "38.2,-77.4,60,60"
    assert option(launch, "--defaults") == "plane.parm,m2pem.parm"
    assert launch.files["m2pem.parm"] == "BATT_FS_LOW_ACT 2\n"


@pytest.mark.parametrize(
    ("domain", "failsafe", "expected"),
    [
        ("air", "return_to_launch", {"FS_GCS_ENABLE": "1", "FS_OPTIONS": "0"}),
        ("air", "land", {"FS_GCS_ENABLE": "5", "FS_OPTIONS": "0"}),
        ("air", "hold", {"FS_GCS_ENABLE": "7"}),
        ("ground", "return_to_launch", {"FS_GCS_ENABLE": "1", "FS_ACTION": "1"}),
        ("ground", "hold", {"FS_GCS_ENABLE": "1", "FS_ACTION": "2"}),
        ("ground", "continue", {"FS_GCS_ENABLE": "0"}),
    ],
)
def test_the_autopilot_does_what_the_fleet_says_when_its_link_is_lost(
    tmp_path: Path, ardupilot: Path, domain: str, failsafe: str, expected: dict[str, str]
) -> None:
    (launch,) = started(
        tmp_path, ardupilot, v=vehicle(domain, failsafe=failsafe, gcs_system_id=250)
    )
    lines = dict(line.split() for line in launch.files["m2pem.parm"].splitlines())
    assert lines == {**expected, "MAV_GCS_SYSID": "250", "SYSID_MYGCS": "250"}


def test_parameters_that_the_fleet_names_go_before_those_of_its_failsafe(
    tmp_path: Path, ardupilot: Path
) -> None:
    said = {"parameters": {"FS_GCS_ENABLE": 3}}
    (launch,) = started(tmp_path, ardupilot, v=vehicle(failsafe="return_to_launch", sitl=said))
    assert "FS_GCS_ENABLE 3\n" in launch.files["m2pem.parm"]
    assert "FS_GCS_ENABLE 1\n" not in launch.files["m2pem.parm"]


def test_what_is_not_software_in_the_loop_over_mavlink_is_left_alone(
    tmp_path: Path, ardupilot: Path
) -> None:
    real = vehicle(system_id=2) | {"sitl": False}
    other = {"domain": "ground", "arbiter": "sim", "sitl": True}
    assert [x.name for x in started(tmp_path, ardupilot, a=vehicle(), b=real, c=other)] == ["a"]


def test_each_url_has_a_serial_port(tmp_path: Path, ardupilot: Path) -> None:
    urls = [URL, "udpin://localhost:14551"]
    (launch,) = started(tmp_path, ardupilot, uav1=vehicle(url=urls))
    assert option(launch, "--serial1") == "udpclient:127.0.0.1:14551"
    assert option(launch, "--serial2") == "none:2"


# --- where the programs and their parameters are -----------------------------------------------


def test_a_folder_of_programs_has_their_parameters_beside_them(tmp_path: Path) -> None:
    program = touched(tmp_path / "out/bin/arducopter")
    touched(tmp_path / "out/bin/arducopter.parm", "# beside\n")
    for folder in ("out", "out/bin"):
        (launch,) = started(tmp_path, tmp_path / folder, uav1=vehicle())
        assert launch.command[0] == str(program)
        assert launch.files == {"arducopter.parm": "# beside\n"}


def test_parameters_beside_a_link_go_before_those_of_what_it_links_to(
    tmp_path: Path, ardupilot: Path
) -> None:
    links = tmp_path / "links"
    links.mkdir()
    (links / "arducopter").symlink_to(ardupilot / "build/sitl/bin/arducopter")
    (launch,) = started(tmp_path, links, uav1=vehicle())
    assert launch.command[0] == str(links / "arducopter")
    assert launch.files == {"copter.parm": "# copter\n"}
    touched(links / "arducopter.parm", "# beside the link\n")
    (launch,) = started(tmp_path, links, uav1=vehicle())
    assert launch.files == {"arducopter.parm": "# beside the link\n"}


@pytest.mark.parametrize(
    ("domain", "sitl", "said"),
    [
        (
            "subsurface",
            {},
            r"no program ardusub in .*build/sitl/bin or .*waf --targets bin/ardusub",
        ),
        ("air", {"frame": "plane"}, r"plane needs the parameters Tools/autotest/models/plane.parm"),
    ],
)
def test_a_program_or_parameters_that_are_missing_are_named(
    tmp_path: Path, ardupilot: Path, domain: str, sitl: dict[str, Any], said: str
) -> None:
    with pytest.raises(SitlError, match=said):
        started(tmp_path, ardupilot, v=vehicle(domain, sitl=sitl))


# --- PX4 ---------------------------------------------------------------------------------------

PX4 = {"firmware": "px4"}


def test_px4_is_started_as_the_instance_that_its_system_id_and_port_name(
    tmp_path: Path, px4: Path
) -> None:
    url = "udpin://127.0.0.1:14542"
    said = {"firmware": "px4", "parameters": {"COM_LOW_BAT_ACT": 3}}
    (launch,) = started(
        tmp_path,
        None,
        px4,
        uav3=vehicle(system_id=3, url=url, sitl=said, failsafe="return_to_launch"),
    )
    assert launch.command == (
        *(str(px4 / "bin/px4"), "-d", "-i", "2"),
        *("-w", str(tmp_path / "runs/uav3"), str(px4 / "etc")),
    )
    assert launch.environment == {
        "PX4_SIMULATOR": "sihsim",
        "PX4_SIM_MODEL": "sihsim_quadx",
        "PX4_SIM_SPEED_FACTOR": "5",
        "PX4_HOME_LAT": "38.1",
        "PX4_HOME_LON": "-77.3",
        "PX4_HOME_ALT": "60",
        "PX4_HOME_YAW": "0",
        "PX4_PARAM_NAV_DLL_ACT": "2",
        "PX4_PARAM_COM_LOW_BAT_ACT": "3",
    }


@pytest.mark.parametrize(
    ("one", "said"),
    [
        (
            vehicle(system_id=3, url="udpin://127.0.0.1:14541", sitl=PX4),
            "system_id 3 is instance 2 and sends to udpin://127.0.0.1:14542 alone, not to "
            "udpin://127.0.0.1:14541",
        ),
        (
            vehicle(url="udpin://127.0.0.1:14540", sitl={**PX4, "frame": "iris"}),
            "no model 'iris'; it has: sihsim_airplane, sihsim_quadx",
        ),
        (vehicle("surface", sitl=PX4), "PX4 simulates no surface vehicle"),
    ],
)
def test_px4_that_cannot_be_as_the_fleet_says_is_refused(
    tmp_path: Path, px4: Path, one: dict[str, Any], said: str
) -> None:
    with pytest.raises(PluginError) as error:
        started(tmp_path, None, px4, uav1=one)
    assert said in str(error.value)


def test_a_system_id_of_px4_is_not_that_of_another_vehicle_on_its_ground_station_port(
    tmp_path: Path, ardupilot: Path, px4: Path
) -> None:
    url = "udpin://127.0.0.1:14540"
    with pytest.raises(PluginError, match=r"a: connection.system_id: b has it, too"):
        started(tmp_path, ardupilot, px4, a=vehicle(), b=vehicle(url=url, sitl=PX4))


# --- what is refused ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("one", "said"),
    [
        (vehicle(url="udpin://0.0.0.0:14550"), "udpin://127.0.0.1:14550, and not to udpin://0.0"),
        (vehicle(url="udpout://127.0.0.1:14550"), "and not to udpout://127.0.0.1:14550"),
        (vehicle(url="serial:///dev/ttyACM0:57600"), "such as udpin://127.0.0.1:14550"),
        (vehicle(url="udpin://127.0.0.1:0"), "and not to udpin://127.0.0.1:0"),
        (vehicle(url=[f"udpin://127.0.0.1:{p}" for p in (1, 2, 3, 4)]), "to 3 places at most"),
        (vehicle(component_id=2), "v: connection.component_id: autopilots have 1"),
        (vehicle("ground", sitl={"frame": "quad"}), "domain ground; known: rover, rover-skid"),
        (
            vehicle(sitl={"frames": "quad"}),
            "v: connection.sitl.frames: there is no such setting; did",
        ),
        (vehicle(sitl={"frame": 4}), "connection.sitl.frame: 4 is not a name"),
        (vehicle(sitl={"firmware": "inav"}), "'inav' is none of ardupilot, px4"),
        (vehicle(sitl={"home": [100, 0]}), "connection.sitl.home: [100, 0] is not"),
        (vehicle(sitl={"home": "zurich"}), "connection.sitl.home: 'zurich' is not"),
        (vehicle(sitl={"heading": 60}), "connection.sitl.heading: "),
        (vehicle(sitl={"parameters": {"A": "b"}}), "connection.sitl.parameters: "),
        (vehicle(sitl="quad"), "connection.sitl: 'quad' is not a map such as {frame: quad}"),
        (vehicle(sitl=PX4, url="udpin://127.0.0.1:14540"), "give its folder with --px4 FOLDER"),
    ],
)
def test_what_cannot_be_started_as_the_fleet_says_is_refused_by_vehicle_and_key(
    tmp_path: Path, ardupilot: Path, one: dict[str, Any], said: str
) -> None:
    with pytest.raises(PluginError) as error:
        started(tmp_path, ardupilot, v=one)
    assert str(error.value).startswith("v")
    assert said in str(error.value)


def test_where_ardupilot_is_must_be_said(tmp_path: Path) -> None:
    with pytest.raises(PluginError, match=r"v runs ArduPilot: .* --ardupilot FOLDER"):
        started(tmp_path, None, v=vehicle())
