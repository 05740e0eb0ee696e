import pytest
from m2pem_plugin_mavlink.vehicle.driver import FlightMode
from m2pem_plugin_mavlink.vehicle.identity import Firmware, Identity, Kind, identity
from m2pem_plugin_mavlink.vehicle.modes import modes_of


def ardupilot(kind: Kind) -> Identity:
    return Identity(Firmware.ARDUPILOT, kind)


@pytest.mark.parametrize(
    ("who", "custom_mode", "name", "purpose"),
    [
        (ardupilot(Kind.COPTER), 4, "GUIDED", FlightMode.GUIDED),
        (ardupilot(Kind.COPTER), 3, "AUTO", FlightMode.MISSION),
        (ardupilot(Kind.COPTER), 17, "BRAKE", FlightMode.HOLD),
        (ardupilot(Kind.COPTER), 0, "STABILIZE", FlightMode.MANUAL),
        (ardupilot(Kind.COPTER), 18, "THROW", FlightMode.OTHER),
        (ardupilot(Kind.ROVER), 15, "GUIDED", FlightMode.GUIDED),
        (ardupilot(Kind.ROVER), 4, "HOLD", FlightMode.HOLD),
        (ardupilot(Kind.BOAT), 11, "RTL", FlightMode.RETURN),
        (ardupilot(Kind.PLANE), 15, "GUIDED", FlightMode.GUIDED),
        (ardupilot(Kind.SUB), 19, "MANUAL", FlightMode.MANUAL),
        (Identity(Firmware.PX4, Kind.COPTER), 4 << 16 | 3 << 24, "AUTO.LOITER", FlightMode.HOLD),
        (Identity(Firmware.PX4, Kind.COPTER), 6 << 16, "OFFBOARD", FlightMode.GUIDED),
        (Identity(Firmware.PX4, Kind.ROVER), 4 << 16 | 5 << 24, "AUTO.RTL", FlightMode.RETURN),
        (ardupilot(Kind.COPTER), 99, "mode 99", FlightMode.OTHER),
    ],
)
def test_a_mode_has_a_name_and_a_purpose(
    who: Identity, custom_mode: int, name: str, purpose: FlightMode
) -> None:
    modes = modes_of(who)
    assert (modes.name(custom_mode), modes.purpose(custom_mode)) == (name, purpose)


@pytest.mark.parametrize("firmware", Firmware)
@pytest.mark.parametrize("kind", Kind)
def test_every_mode_with_a_purpose_has_a_number(firmware: Firmware, kind: Kind) -> None:
    modes = modes_of(Identity(firmware, kind))
    for name, purpose in modes.purposes.items():
        assert modes.purpose(modes.number(name)) is purpose


def test_of_two_modes_for_one_purpose_the_better_one_is_commanded() -> None:
    held = {
        kind: modes_of(ardupilot(kind)).name(
            modes_of(ardupilot(kind)).for_purpose(FlightMode.HOLD) or 0
        )
        for kind in (Kind.COPTER, Kind.ROVER, Kind.BOAT, Kind.PLANE)
    }
    assert held == {"copter": "BRAKE", "rover": "HOLD", "boat": "LOITER", "plane": "LOITER"}


@pytest.mark.parametrize(("autopilot", "type_"), [(8, 6), (3, 6), (3, 26), (12, 5), (0, 2)])
def test_what_is_no_vehicle_has_no_identity(autopilot: int, type_: int) -> None:
    assert identity(autopilot, type_) is None
