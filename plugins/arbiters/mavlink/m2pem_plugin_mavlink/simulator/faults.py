"""The faults of a simulated vehicle, by calls and as text: "1: cut link at 40 s for 600 s".

sim[1].faults.cut_link()
sim[1].faults.after_arming(40, Faults.lose_gps)
"""

import re
from collections.abc import Callable, Mapping

from m2pem.api.faults import (
    BATTERY,
    Effect,
    FaultGrammar,
    FaultKind,
    FaultSchedule,
    PlannedFault,
    battery_left,
    fixed,
)
from m2pem_plugin_mavlink.simulator.interfaces import CommandRefusal
from m2pem_plugin_mavlink.simulator.messages import Result
from m2pem_plugin_mavlink.simulator.server import VehiclePort

Action = Callable[["Faults"], object]

LOW = 0.069
"""So full is a low battery: below ArduPilot's threshold, and critical for PX4."""


class Faults:
    """All that can go wrong with a vehicle. Times are in seconds of simulated time."""

    def __init__(self, port: VehiclePort) -> None:
        self.autopilot = port.autopilot
        self._wires = (port.outward, port.inward)
        self._schedule = FaultSchedule()
        self._after_arming: list[tuple[float, Action]] = []
        self._armed_s: float | None = None

    def cut_link(self) -> None:
        """Carry nothing, in both directions."""
        for wire in self._wires:
            wire.cut = True

    def restore_link(self) -> None:
        """End the cut."""
        for wire in self._wires:
            wire.cut = False

    def lose_gps(self) -> None:
        """Lose all satellites."""
        self.autopilot.injected_faults.gps_lost = True

    def find_gps(self) -> None:
        """Find satellites again."""
        self.autopilot.injected_faults.gps_lost = False

    def set_battery(self, left: float = LOW) -> None:
        """Drain the battery from there on; 1 is full."""
        self.autopilot.battery.left = min(1.0, max(0.0, left))

    def refuse_arming(self, text: str = "Motors: Check frame class and type") -> None:
        """Do not arm, and say why."""
        self.autopilot.injected_faults.arming = text

    def allow_arming(self) -> None:
        """Arm as ever."""
        self.autopilot.injected_faults.arming = None

    def refuse_command(
        self,
        command: int,
        result: Result | None = Result.FAILED,
        text: str = "",
        times: int | None = None,
    ) -> None:
        """A command (MAV_CMD) is not obeyed, but answered so (None: not answered at all)."""
        self.autopilot.injected_faults.commands[command] = CommandRefusal(result, text, times)

    def allow_command(self, command: int) -> None:
        """Obey a command as ever."""
        self.autopilot.injected_faults.commands.pop(command, None)

    @property
    def modes(self) -> Mapping[str, int]:
        """The vehicle's modes by their names."""
        return {each.name: each.number for each in self.autopilot.modes.by_number.values()}

    def take_over(self, mode: str) -> None:
        """Another ground station, or a pilot, changes the mode.

        Raises:
            ValueError: the vehicle has no such mode.
        """
        if mode not in self.modes:
            raise ValueError(f"there is no mode {mode!r}; there are: {', '.join(self.modes)}")
        self.autopilot.modes.switch(self.modes[mode])

    # --- time -------------------------------------------------------------------------------------

    def after(self, seconds: float, action: Action) -> None:
        """Do something later."""
        self._schedule.at(self.autopilot.now_s + seconds, lambda: action(self))

    def after_arming(self, seconds: float, action: Action) -> None:
        """Do something so long after the vehicle was armed for the first time."""
        if self._armed_s is None:
            self._after_arming.append((seconds, action))
        else:
            self._schedule.at(self._armed_s + seconds, lambda: action(self))

    def step(self) -> None:
        """Do what is due."""
        autopilot = self.autopilot
        if self._armed_s is None and autopilot.log.counts["armed"]:
            events = autopilot.log.events
            first_s = next((each.at_s for each in events if each.kind == "armed"), autopilot.now_s)
            self._armed_s = first_s
            for seconds, action in self._after_arming:
                self.after_arming(seconds, action)
            self._after_arming.clear()
        self._schedule.run_until(autopilot.now_s)


# --- as text --------------------------------------------------------------------------------------

Match = re.Match[str]


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


def _full(is_so: bool) -> Action:
    return lambda faults: setattr(faults.autopilot.injected_faults, "camera_full", is_so)


def _mode(match: Match) -> Effect[Faults]:
    mode = match[1].upper()
    return Effect(lambda faults: faults.take_over(mode))


MODE = FaultKind(r"mode\s+(\S+)", _mode, timed=True)
KINDS: Mapping[str, FaultKind[Faults]] = {
    "cut link": FaultKind(r"cut link", fixed(Faults.cut_link, Faults.restore_link)),
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
