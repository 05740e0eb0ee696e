"""The faults of simulated autopilots as text: "1: cut link at 40 s for 600 s"."""

import re
from collections.abc import Callable, Mapping

from m2pem.api.faults import (
    BATTERY,
    NUMBER,
    Effect,
    FaultGrammar,
    FaultKind,
    PlannedFault,
    battery_left,
    fixed,
)
from m2pem_plugin_mavlink.simulator.faults.faults import LOW, Direction, Faults
from m2pem_plugin_mavlink.simulator.faults.link import NEVER, Rate, every, share

Match = re.Match[str]


def _rate(match: Match) -> Rate:
    if match[2] is not None:
        return every(int(match[2]), int(match[2]) - 1)
    percent = float(match[1])
    if percent > 100:
        raise ValueError(f"there are no more than 100 % of the frames, so not {percent:g} %")
    return share(percent / 100)


def _link(name: str) -> Callable[[Match], Effect[Faults]]:
    def effect(match: Match) -> Effect[Faults]:
        direction = Direction(match[3] or Direction.BOTH)
        rate = _rate(match)
        return Effect(
            lambda faults: faults.set_link(direction, **{name: rate}),
            lambda faults: faults.set_link(direction, **{name: NEVER}),
        )

    return effect


def _delay(match: Match) -> Effect[Faults]:
    seconds, direction = float(match[1]), Direction(match[2] or Direction.BOTH)
    return Effect(
        lambda faults: faults.set_link(direction, delay_s=seconds),
        lambda faults: faults.set_link(direction, delay_s=0.0),
    )


def _battery(match: Match) -> Effect[Faults]:
    left = battery_left(match, LOW)
    return Effect(lambda faults: faults.set_battery(left))


def _refuse_arming(match: Match) -> Effect[Faults]:
    said = () if match[1] is None else (match[1],)
    return Effect(lambda faults: faults.refuse_arming(*said), Faults.allow_arming)


def _refuse_command(match: Match) -> Effect[Faults]:
    command = int(match[1])
    return Effect(
        lambda faults: faults.refuse_command(command),
        lambda faults: faults.allow_command(command),
    )


def _full(is_so: bool) -> Callable[[Faults], object]:
    return lambda faults: setattr(faults.autopilot.injected_faults, "camera_full", is_so)


def _mode(match: Match) -> Effect[Faults]:
    mode = match[1].upper()
    return Effect(lambda faults: faults.take_over(mode))


WHERE = r"(?:\s+(sent|received))?"
HOW_OFTEN = rf"\s+(?:{NUMBER}\s*%|every\s+(\d+)){WHERE}"
MODE = FaultKind(r"mode\s+(\S+)", _mode, timed=True)
KINDS: Mapping[str, FaultKind[Faults]] = {
    "cut link": FaultKind(r"cut link", fixed(Faults.cut_link, Faults.restore_link)),
    "drop 5 % [sent|received], drop every 7 [sent|received]": FaultKind(
        f"drop{HOW_OFTEN}", _link("drop")
    ),
    "duplicate ...": FaultKind(f"duplicate{HOW_OFTEN}", _link("duplicate")),
    "reorder ...": FaultKind(f"reorder{HOW_OFTEN}", _link("reorder")),
    "corrupt ...": FaultKind(f"corrupt{HOW_OFTEN}", _link("corrupt")),
    "delay 2 s [sent|received]": FaultKind(rf"delay\s+{NUMBER}\s*s{WHERE}", _delay),
    "battery low, battery 12 %": FaultKind(BATTERY, _battery),
    "lose gps": FaultKind(r"lose gps", fixed(Faults.lose_gps, Faults.find_gps)),
    'refuse arming, refuse arming "text"': FaultKind(
        r"refuse arming(?:\s+\"([^\"]+)\")?", _refuse_arming
    ),
    "camera full": FaultKind(r"camera full", fixed(_full(True), _full(False))),
    "refuse command 22": FaultKind(r"refuse command\s+(\d+)", _refuse_command),
    "mode LOITER at 40 s": MODE,
}

GRAMMAR = FaultGrammar(
    KINDS,
    "1: cut link at 40 s for 600 s",
    times="after the first arming; without: from the start",
    targets=(r"\d+", "vehicles: say their system ids, such as 1 or 1,2"),
)


def plan(fault: PlannedFault[Faults], faults: Faults) -> None:
    """Let a fault happen to a vehicle when its time comes.

    Raises:
        FaultError: the vehicle has no such mode.
    """
    if fault.kind is MODE and (mode := fault.words.split()[1].upper()) not in faults.modes:
        raise fault.error(
            f"vehicle {faults.autopilot.spec.system} has no mode {mode!r}; "
            f"it has: {', '.join(faults.modes)}"
        )

    def begin(faults: Faults) -> None:
        fault.start(faults, lambda seconds, call: faults.after(seconds, lambda _: call()))

    if fault.at_s is None:
        begin(faults)
    else:
        faults.after_arming(fault.at_s, begin)
