"""Errors of Nav2 goals, translated to the error codes of missions."""

from collections.abc import Sequence
from typing import Any

from m2pem.api import BehaviorState
from m2pem_plugin_ros.drivers.driver import Outcome

_BLOCKED = {
    104: "the controller exceeded its time for retries",
    105: "no progress was made",
    106: "the controller found no valid command",
    203: "the vehicle is outside of the map",
    204: "the goal is outside of the map",
    205: "the vehicle is on an obstacle",
    206: "the goal is occupied",
    208: "there is no valid path",
    303: "the vehicle is outside of the map",
    304: "a goal is outside of the map",
    305: "the vehicle is on an obstacle",
    306: "a goal is occupied",
    308: "there is no valid path",
    503: "the path is in collision",
    703: "there is an obstacle in the way",
    714: "there is an obstacle behind it",
    724: "there is an obstacle ahead",
}
_LATE = {
    107: "the controller took too long",
    207: "the planner took too long",
    307: "the planner took too long",
    502: "the smoother took too long",
    701: "turning took too long",
    711: "backing up took too long",
    721: "driving on took too long",
    9003: "it took too long",
    9103: "it took too long",
}
_OTHER = {
    100: "the controller failed",
    101: "there is no such controller",
    102: "the controller lacks a transform",
    103: "the path is not valid",
    200: "the planner failed",
    201: "there is no such planner",
    202: "the planner lacks a transform",
    300: "the planner failed",
    301: "there is no such planner",
    302: "the planner lacks a transform",
    309: "no poses were given",
    600: "following waypoints failed",
    601: "the task at a waypoint failed",
    602: "no waypoint is valid",
    603: "a waypoint was missed",
    710: "backing up failed",
    712: "backing up lacks a transform",
    713: "the request to back up was invalid",
}


class NavigationError(Exception):
    """The order cannot be done, or cannot be continued. `code` is an error code of
    docs/missions.md."""

    def __init__(
        self, reason: str, code: str = "FAILED", state: BehaviorState = BehaviorState.FAILED
    ) -> None:
        super().__init__(reason)
        self.reason = reason
        self.code = code
        self.state = state

    @property
    def outcome(self) -> Outcome:
        return Outcome(self.state, self.code, self.reason)


def taken_over(reason: str) -> NavigationError:
    """Another client commands Nav2: nothing more is sent."""
    return NavigationError(reason, "TAKEN_OVER")


def aborted(result: Any) -> NavigationError:
    """Return the error of an aborted goal, by its result. Some releases of Nav2 lack some
    fields."""
    error_code = int(getattr(result, "error_code", 0))
    message = str(getattr(result, "error_msg", "")).strip()
    meaning = _BLOCKED.get(error_code) or _LATE.get(error_code) or _OTHER.get(error_code)
    if error_code == 0:
        what = "Nav2 aborted the goal" + ("" if message else ", without a reason")
    else:
        what = f"Nav2 aborted the goal: {meaning or 'unknown reason'} (error {error_code})"
    reason = f"{what}: {message}" if message else what
    if error_code in _BLOCKED:
        return NavigationError(reason, "ROUTE_BLOCKED")
    return NavigationError(reason, "TIMEOUT" if error_code in _LATE else "FAILED")


def missed(waypoints: Sequence[Any]) -> NavigationError:
    """Return the error for waypoints that were skipped by a goal that succeeded."""
    numbers = [int(getattr(w, "index", getattr(w, "waypoint_index", 0))) + 1 for w in waypoints]
    which = ", ".join(str(number) for number in numbers)
    errors = sorted({int(getattr(w, "error_code", 0)) for w in waypoints} - {0})
    codes = "".join(f"; {_BLOCKED.get(e) or _LATE.get(e) or f'error {e}'}" for e in errors)
    return NavigationError(f"Nav2 did not reach waypoint {which}{codes}", "ROUTE_BLOCKED")
