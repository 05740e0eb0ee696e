"""Faults on request: what goes wrong with the next behaviors of a resource."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

FAULT_KINDS = ("reject", "fail", "stall", "lose_link")


@dataclass(frozen=True, slots=True)
class Fault:
    """`kind` is one of `FAULT_KINDS`; it strikes `after_s` into the behavior.

    `behavior`: the name of those that it strikes, "" for all. `times`: how many of them.

    * reject: the behavior is refused (`after_s` has no meaning).
    * fail: the vehicle stops, and the behavior fails with `error` ("" is FAILED).
    * stall: the vehicle stops and nothing more is heard of the behavior.
    * lose_link: nothing more is heard of the vehicle, and it hears nothing.
    """

    kind: str
    behavior: str = ""
    after_s: float = 0.0
    error: str = ""
    times: int = 1


class FaultList:
    """The faults that still wait for a behavior of one resource, first come first served."""

    def __init__(self, faults: Iterable[Fault] = ()) -> None:
        self._waiting: list[Fault] = list(faults)

    def add(self, fault: Fault) -> None:
        """One more."""
        self._waiting.append(fault)

    def take(self, behavior: str) -> Fault | None:
        """The fault that strikes a behavior which starts now; used up by this."""
        for index, fault in enumerate(self._waiting):
            if fault.behavior in ("", behavior):
                if fault.times > 1:
                    self._waiting[index] = replace(fault, times=fault.times - 1)
                else:
                    del self._waiting[index]
                return fault
        return None
