"""The faults of simulated vehicles, as text (`m2pem sim vda5050 --fault`)."""

import re
from typing import Protocol

from m2pem.api.faults import BATTERY, Effect, FaultGrammar, FaultKind, battery_left, fixed

LOW = 0.1


class FaultTarget(Protocol):
    """What a fault strikes: a vehicle and its connection to the broker."""

    def set(self, name: str, value: object) -> None: ...
    def set_mode(self, mode: str) -> None: ...
    def cut(self, is_cut: bool) -> None: ...
    def mute(self, is_mute: bool) -> None: ...
    def stick(self, is_stuck: bool) -> None: ...
    def go_offline(self) -> None: ...
    def come_online(self) -> None: ...


def _setting(name: str, value: object, after: object) -> Effect[FaultTarget]:
    return Effect(lambda it: it.set(name, value), lambda it: it.set(name, after))


def _battery(match: re.Match[str]) -> Effect[FaultTarget]:
    left = battery_left(match, LOW)
    return Effect(lambda it: it.set("battery", left))


def _mode(match: re.Match[str]) -> Effect[FaultTarget]:
    mode = match[1].upper()
    return Effect(lambda it: it.set_mode(mode), lambda it: it.set_mode("AUTOMATIC"))


GRAMMAR: FaultGrammar[FaultTarget] = FaultGrammar(
    {
        "cut link": FaultKind(
            r"cut link", fixed(lambda it: it.cut(True), lambda it: it.cut(False))
        ),
        "mend link": FaultKind(r"mend link", fixed(lambda it: it.cut(False))),
        "silent": FaultKind(r"silent", fixed(lambda it: it.mute(True), lambda it: it.mute(False))),
        "offline": FaultKind(
            r"offline", fixed(lambda it: it.go_offline(), lambda it: it.come_online())
        ),
        "mode MANUAL": FaultKind(r"mode\s+(automatic|semiautomatic|manual|service|teachin)", _mode),
        "estop": FaultKind(r"estop", lambda _: _setting("e_stop", "MANUAL", "NONE")),
        "lose gps": FaultKind(r"lose gps", lambda _: _setting("localized", False, True)),
        "stuck": FaultKind(r"stuck", fixed(lambda it: it.stick(True), lambda it: it.stick(False))),
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
            r"accept orders", fixed(lambda it: it.set("refuses_orders", ""))
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
