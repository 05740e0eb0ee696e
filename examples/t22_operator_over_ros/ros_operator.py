"""An operator over ROS: starts a mission, answers what it asks, and watches it to its end.

Plain rclpy and m2pem_interfaces: it knows nothing else of m2pem. Ends with 0 if the mission
completed or terminated itself, 1 if it failed, 2 if something was refused, 3 if it took too long,
and 130 if it was stopped. On a terminal, a line answers what is asked: a decision, or its number.
"""

import argparse
import array
import json
import queue
import sys
import threading
import time
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import rclpy
from m2pem_interfaces import msg, srv
from rclpy.executors import ExternalShutdownException
from rclpy.qos import DurabilityPolicy, QoSProfile

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
EVENTS = QoSProfile(depth=1000)
SERVICES = QoSProfile(depth=200)

EXIT_STATUS = {
    msg.RunStatus.COMPLETED: 0,
    msg.RunStatus.TERMINATED: 0,
    msg.RunStatus.FAILED: 1,
    msg.RunStatus.STOPPED: 130,
}
WORDS = {
    msg.RunStatus.RUNNING: "running",
    msg.RunStatus.PAUSED: "paused",
    msg.RunStatus.INTERRUPTED: "interrupted",
    msg.RunStatus.COMPLETED: "completed",
    msg.RunStatus.TERMINATED: "terminated",
    msg.RunStatus.FAILED: "failed",
    msg.RunStatus.STOPPED: "stopped",
}
REFUSED, TOO_LONG, INTERRUPTED = 2, 3, 130
LAST_EVENTS_S = 0.5


class Operator:
    """The operator of one executive, who follows one run."""

    def __init__(self, namespace: str, by: str, answers: dict[str, list[str]]) -> None:
        self.node = rclpy.create_node("operator", namespace=namespace)
        self.by = by
        self.run = ""
        self.status = 0
        self.asked: dict[str, Any] = {}
        self._answers = answers
        self._seq = 0
        self._early: list[Any] = []
        self._typed: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._active: list[str] = []
        subscribe = self.node.create_subscription
        subscribe(msg.OpenPrompts, "prompts", self._see_prompts, LATCHED)
        subscribe(msg.Prompt, "prompt_events", self._see_closed, 100)
        subscribe(msg.MissionStatus, "status", self._see_status, LATCHED)
        subscribe(msg.ActiveElements, "active_elements", self._see_active, LATCHED)
        subscribe(msg.MissionEvent, "events", self._see_event, EVENTS)

    def wait_for_executive(self, deadline_s: float) -> None:
        """Wait for the topics: an event is published once, so a late subscriber misses it."""
        while not (self.node.count_publishers("events") and self.node.count_publishers("status")):
            self.spin(deadline_s)

    def spin(self, deadline_s: float) -> None:
        """Process one ROS callback, if any within 0.1 s, and the typed lines."""
        if time.monotonic() > deadline_s:
            say("it took too long")
            raise SystemExit(TOO_LONG)
        rclpy.spin_once(self.node, timeout_sec=0.1)
        while not self._typed.empty():
            self._answer_typed(self._typed.get())

    def follow(self, run: str) -> None:
        """Print this run's events from now on, and those received before its id was known."""
        self.run = run
        for event in self._early:
            self._see_event(event)
        self._early.clear()

    def ask(self, kind: Any, service: str, deadline_s: float, **fields: Any) -> Any:
        """Call a service and return its response; a refusal ends the program."""
        client = self.node.create_client(kind, service, qos_profile=SERVICES)
        while not client.service_is_ready():
            self.spin(deadline_s)
        future = client.call_async(kind.Request(by=self.by, **fields))
        while not future.done():
            self.spin(deadline_s)
        response = future.result()
        if not response.success:
            say(f"{service} refused: {response.message}")
            raise SystemExit(REFUSED)
        return response

    def answer(self, prompt: Any, decision: str) -> None:
        """Answer a prompt. The response of the executive is printed when it arrives."""
        client = self.node.create_client(srv.AnswerPrompt, "answer_prompt", qos_profile=SERVICES)
        request = srv.AnswerPrompt.Request(
            run=prompt.run, prompt=prompt.prompt, decision=decision, by=self.by
        )

        def print_response(future: Any) -> None:
            response = future.result()
            how = "taken" if response.success else f"refused: {response.message}"
            say(f"answer to {prompt.prompt}: {decision}: {how}")

        client.call_async(request).add_done_callback(print_response)

    def read_terminal(self) -> None:
        """Read lines of the terminal in a thread; `spin` processes them."""

        def read() -> None:
            for line in sys.stdin:
                self._typed.put(line)

        threading.Thread(target=read, daemon=True).start()

    def _answer_typed(self, line: str) -> None:
        """Answer the latest prompt by a decision or its number."""
        prompt = next(reversed(self.asked.values()), None)
        decision = line.strip()
        if prompt is None or not decision:
            return
        if decision.isdecimal() and 1 <= int(decision) <= len(prompt.decisions):
            decision = prompt.decisions[int(decision) - 1].value
        self.answer(prompt, decision)

    # --- subscriptions --------------------------------------------------------------------------

    def _see_prompts(self, open_prompts: Any) -> None:
        """Print new prompts. The latched topic has all open ones, also for late subscribers."""
        for prompt in open_prompts.prompts:
            if prompt.run != self.run or prompt.prompt in self.asked:
                continue
            self.asked[prompt.prompt] = prompt
            choices = ", ".join(each.value for each in prompt.decisions)
            say(f"{prompt.prompt} {prompt.element} asks: {prompt.text} [{choices}]")
            if scripted := self._answers[prompt.element]:
                self.answer(prompt, scripted.pop(0))

    def _see_closed(self, prompt: Any) -> None:
        if prompt.run == self.run and prompt.state == msg.Prompt.ANSWERED:
            say(f"{prompt.prompt} was answered by {prompt.answered_by}: {prompt.decision}")

    def _see_status(self, executive: Any) -> None:
        for run in executive.runs:
            if run.run == self.run and run.status != self.status:
                self.status = run.status
                detail = f": {run.detail}" if run.detail else ""
                say(f"{run.run} is {WORDS[run.status]}{detail}")

    def _see_active(self, elements: Any) -> None:
        active = [
            " ".join([each.element, *each.behaviors, *each.resources])
            for each in elements.elements
            if each.run == self.run
        ]
        if active and active != self._active:
            say(f"active: {', '.join(active)}")
        self._active = active

    def _see_event(self, event: Any) -> None:
        if not self.run:
            self._early.append(event)
        if event.run != self.run:
            return
        if self._seq and event.seq > self._seq + 1:
            say(f"{event.seq - self._seq - 1} events were not received")
        self._seq = event.seq
        say(f"{event.mission_time_s:7.1f} s  {event.text}")


def say(text: str) -> None:
    """Print a line at once."""
    print(text, flush=True)


def geometry(text: str) -> tuple[str, Any, str]:
    """Read NAME=FILE: the name, the GeoJSON's coordinates, and its altitude frame."""
    name, _, file = text.partition("=")
    feature = json.loads(Path(file).read_text(encoding="utf-8"))
    if feature["type"] == "FeatureCollection":
        (feature,) = feature["features"]
    properties = feature.get("properties") or {}
    frame = properties.get("altitude_frame", "")
    if "altitude_frames" in properties:
        sys.exit(f"{file}: its altitudes count from different heights, and a request has one frame")
    return name, feature.get("geometry", feature)["coordinates"], frame


def points(coordinates: Sequence[Sequence[float]]) -> list[Any]:
    """Convert positions of GeoJSON, which has longitudes first."""
    return [
        msg.GeoPoint(
            latitude_deg=float(each[1]),
            longitude_deg=float(each[0]),
            altitude_m=float(each[2]) if len(each) > 2 else float("nan"),
        )
        for each in coordinates
    ]


def hand_over(operator: Operator, options: argparse.Namespace, deadline_s: float) -> None:
    """Set routes, areas and waypoints."""
    for text in options.set_route:
        name, line, frame = geometry(text)
        fields = {"name": name, "waypoints": points(line), "altitude_frame": frame}
        operator.ask(srv.SetRoute, "set_route", deadline_s, **fields)
        say(f"route {name} is handed over")
    for text in options.set_area:
        name, rings, frame = geometry(text)
        outline, *holes = [msg.Ring(points=points(ring[:-1])) for ring in rings]
        fields = {"name": name, "outline": outline, "holes": holes, "altitude_frame": frame}
        operator.ask(srv.SetArea, "set_area", deadline_s, **fields)
        say(f"area {name} is handed over")
    for text in options.set_waypoints:
        name, place, frame = geometry(text)
        positions = points(place if isinstance(place[0], list) else [place])
        fields = {"name": name, "waypoints": positions, "altitude_frame": frame}
        operator.ask(srv.SetWaypoints, "set_waypoints", deadline_s, **fields)
        say(f"waypoints {name} are handed over")


def answers_of(options: argparse.Namespace) -> dict[str, list[str]]:
    """Read the decisions by the id of the user task, visit by visit."""
    answers: dict[str, list[str]] = defaultdict(list)
    if options.answers:
        import yaml  # noqa: PLC0415  # it comes with rclpy

        content = yaml.safe_load(Path(options.answers).read_text(encoding="utf-8"))
        for element, decisions in content["answers"].items():
            answers[element] += map(str, decisions)
    for text in options.answer:
        element, _, decision = text.partition("=")
        answers[element].append(decision)
    return answers


def read_options() -> argparse.Namespace:
    """Parse the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--mission", metavar="FILE", help="a BPMN file here, whose bytes are sent")
    what.add_argument("--url", help="a mission where the executive finds it: a path or a URL")
    what.add_argument("--run", help="start nothing, and follow this run")
    parser.add_argument("--data", action="append", default=[], metavar="KEY=JSON")
    parser.add_argument("--answers", metavar="FILE", help="an answers file of m2pem")
    parser.add_argument("--answer", action="append", default=[], metavar="ELEMENT=DECISION")
    for kind in ("route", "area", "waypoints"):
        parser.add_argument(f"--set-{kind}", action="append", default=[], metavar="NAME=GEOJSON")
    parser.add_argument("--namespace", default="/m2pem")
    parser.add_argument("--by", default="ros_operator", help="who asks, for the journal")
    parser.add_argument("--within", type=float, default=3600, metavar="SECONDS")
    return parser.parse_args(rclpy.utilities.remove_ros_args(sys.argv)[1:])


def begin(operator: Operator, options: argparse.Namespace, deadline_s: float) -> None:
    """Start the mission."""
    data = [
        msg.KeyValue(key=key, value=value)
        for key, _, value in (each.partition("=") for each in options.data)
    ]
    content = Path(options.mission).read_bytes() if options.mission else b""
    response = operator.ask(
        srv.StartMission,
        "start_mission",
        deadline_s,
        url=options.url or "",
        bpmn=array.array("B", content),
        data=data,
    )
    say(f"started {response.run}")
    operator.follow(response.run)


def main() -> int:
    """Operate one run to its end, and return the exit status."""
    options = read_options()
    rclpy.init()
    deadline_s = time.monotonic() + options.within
    operator = Operator(options.namespace, options.by, answers_of(options))
    if sys.stdin.isatty():
        operator.read_terminal()
    operator.wait_for_executive(deadline_s)
    hand_over(operator, options, deadline_s)
    if options.run:
        operator.follow(options.run)
    else:
        begin(operator, options, deadline_s)
    while operator.status not in EXIT_STATUS:
        operator.spin(deadline_s)
    # Topics have no common order: the last events may arrive after the final status.
    until_s = time.monotonic() + LAST_EVENTS_S
    while time.monotonic() < until_s:
        operator.spin(until_s + 1)
    return EXIT_STATUS[operator.status]


if __name__ == "__main__":
    try:
        status = main()
    except (KeyboardInterrupt, ExternalShutdownException):
        status = INTERRUPTED
    sys.exit(status)
