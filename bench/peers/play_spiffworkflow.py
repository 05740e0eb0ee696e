"""Plays a graph with SpiffWorkflow, by its own interface: JSON in, JSON out.

Run by its own interpreter, which has SpiffWorkflow and not m2pem. Parsing and running recurse, so
the limit of recursion is lifted, which its users must know to do, and so is the depth of 1,000
tasks after which it stops and says that all is completed. `"stock": true` leaves both.
"""

import io
import json
import sys
import threading
import time
from pathlib import Path
from statistics import median
from typing import Any

from SpiffWorkflow.bpmn.parser import BpmnParser
from SpiffWorkflow.bpmn.util.task import BpmnTaskIterator
from SpiffWorkflow.bpmn.workflow import BpmnWorkflow
from SpiffWorkflow.util.task import TaskIterator, TaskState

ENOUGH_S = 0.3
MOST_TIMES = 20
STACK_BYTES = 1 << 30
DEEPEST = 1000


def go_deeper() -> None:
    """Have what walks through the tasks, the deepest of which it leaves out, go to the end."""
    for walker in (TaskIterator, BpmnTaskIterator):
        defaults = walker.__init__.__defaults__
        assert DEEPEST in defaults, "another version of SpiffWorkflow?"
        walker.__init__.__defaults__ = tuple(
            sys.maxsize if each == DEEPEST else each for each in defaults
        )


def told(workflow: BpmnWorkflow) -> dict[str, Any]:
    """What came of an instance."""
    done = workflow.get_tasks(state=TaskState.COMPLETED)
    tasks = sum((task.task_spec.bpmn_id or "").startswith("t") for task in done)
    ended = "completed" if workflow.is_completed() else "running"
    data = workflow.last_task.data if workflow.last_task else {}
    return {"ended": ended, "data": dict(data), "tasks": tasks}


def play(specs: tuple[Any, Any], order: dict[str, Any]) -> tuple[float, list[Any]]:
    """All instances, one after the other; CPU seconds and what came of each."""
    spent, seen = 0.0, []
    for _ in range(order["instances"]):
        began = time.process_time()
        workflow = BpmnWorkflow(*specs)
        workflow.get_next_task(spec_name="Start").set_data(**order["given"])
        workflow.do_engine_steps()
        spent += time.process_time() - began
        seen.append(told(workflow))
    return spent, seen


def answer(order: dict[str, Any]) -> None:
    """Play the order, and answer."""
    began = time.process_time()
    parser = BpmnParser()
    parser.add_bpmn_io(io.BytesIO(order["xml"].encode()))
    spec, inner = parser.get_spec("BENCH"), parser.get_subprocess_specs("BENCH")
    parse_s = time.process_time() - began
    times: list[float] = []
    enough_s = order.get("enough_s", ENOUGH_S)
    while not times or (sum(times) < enough_s and len(times) < MOST_TIMES):
        spent, seen = play((spec, inner), order)
        times.append(spent)
    different = [each for place, each in enumerate(seen) if each not in seen[:1] or not place]
    figures = {"parse_s": parse_s, "cpu_s": median(times), "peak_kb": peak_kb()}
    print(json.dumps({**figures, "outcomes": different, "instances": len(seen)}))


def answer_all(orders: list[dict[str, Any]]) -> None:
    """Play them one after the other."""
    for order in orders:
        answer(order)


def peak_kb() -> int:
    """As in `bench.measured`."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmHWM:"))


def main() -> None:
    """With all the stack that there is, unless it is to run as installed."""
    orders = [json.loads(line) for line in sys.stdin]
    if orders[0].get("stock"):
        answer_all(orders)
        return
    go_deeper()
    sys.setrecursionlimit(10_000_000)
    threading.stack_size(STACK_BYTES)
    thread = threading.Thread(target=answer_all, args=(orders,))
    thread.start()
    thread.join()


if __name__ == "__main__":
    main()
