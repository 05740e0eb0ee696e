"""The faults of simulated vehicles, as text (`m2pem sim vda5050 --fault`)."""

import re
from collections.abc import Callable

from m2pem.api.faults import BATTERY, Effect, FaultGrammar, FaultKind, battery_left, fixed
from m2pem_plugin_vda5050.simulator.simulation import SimulatedVehicle

LOW = 0.1


def _setting(name: str, value: object, after: object) -> Effect[SimulatedVehicle]:
    return Effect(lambda it: it.agv.set(name, value), lambda it: it.agv.set(name, after))


def _switch(name: str) -> Callable[[re.Match[str]], Effect[SimulatedVehicle]]:
    return fixed(lambda it: it.turn(name, True), lambda it: it.turn(name, False))


def _battery(match: re.Match[str]) -> Effect[SimulatedVehicle]:
    left = battery_left(match, LOW)
    return Effect(lambda it: it.agv.set("battery", left))


def _mode(match: re.Match[str]) -> Effect[SimulatedVehicle]:
    mode = match[1].upper()
    return Effect(lambda it: it.agv.set_mode(mode), lambda it: it.agv.set_mode("AUTOMATIC"))


GRAMMAR: FaultGrammar[SimulatedVehicle] = FaultGrammar(
    {
        "cut link": FaultKind(r"cut link", _switch("is_cut")),
        "mend link": FaultKind(r"mend link", fixed(lambda it: it.turn("is_cut", False))),
        "silent": FaultKind(r"silent", _switch("is_mute")),
        "offline": FaultKind(
            r"offline", fixed(lambda it: it.go_offline(), lambda it: it.come_online())
        ),
        "mode MANUAL": FaultKind(r"mode\s+(automatic|semiautomatic|manual|service|teachin)", _mode),
        "estop": FaultKind(r"estop", lambda _: _setting("e_stop", "MANUAL", "NONE")),
        "lose gps": FaultKind(r"lose gps", lambda _: _setting("localized", False, True)),
        "stuck": FaultKind(
            r"stuck",
            fixed(
                lambda it: setattr(it.agv.motion, "stuck", True),
                lambda it: setattr(it.agv.motion, "stuck", False),
            ),
        ),
        "fatal [TEXT]": FaultKind(
            r"fatal(?:\s+(.+))?", lambda match: _setting("fatal", match[1] or "laser scanner", "")
        ),
        "refuse cancel": FaultKind(
            r"refuse cancel", lambda _: _setting("refuses_cancel", True, False)
        ),
        "refuse orders [TEXT]": FaultKind(
            r"refuse orders(?:\s+(.+))?",
            lambda match: _setting("refuses_orders", match[1] or "it cannot now", ""),
        ),
        "accept orders": FaultKind(
            r"accept orders", fixed(lambda it: it.agv.set("refuses_orders", ""))
        ),
        "fail actions": FaultKind(
            r"fail actions", lambda _: _setting("fails_actions", True, False)
        ),
        "battery low": FaultKind(BATTERY, _battery),
    },
    "agv1: mode manual at 20 s for 5 s",
    times="from the start; without: at once",
    targets=(r"\s*[\w.-]+\s*", "names of vehicles"),
)
