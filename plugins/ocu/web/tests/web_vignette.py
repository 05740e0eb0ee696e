"""VIGNETTE1 of the paper, drawn from an empty page."""

from dataclasses import dataclass

from playwright.async_api import expect
from web_drawing import Drawing

PROMPT = "Send the route, then continue"
HAZARD = "Hazard detected"
STOP = "Stop driving"


@dataclass(frozen=True, slots=True)
class Mission:
    """Ids of what was drawn of the main process."""

    ask: str
    decide: str
    call: str
    caught: str
    reverse: str
    end: str


async def draw_main(drawing: Drawing) -> Mission:
    """The main process: ask, and as long as the operator continues, detect, reverse and ask again.

    What it calls is not said yet.
    """
    await drawing.drag("Start", 370, 420)
    ask = await drawing.append("Start", "Ask the operator", "USER SEND ROUTE")
    await drawing.fill("Question", PROMPT)
    decide = await drawing.append(ask, "Exclusive gateway", "Decision?")
    call = await drawing.append_by_key(decide, "Call activity", "DETECTION")
    end = await drawing.append(call, "Terminate end event", "mission ended")
    await drawing.drag(end, 980, 270)
    x, y = await drawing.centre(call)
    caught = await drawing.create("Escalation boundary event", x + 25, y + 40, "hazard detected")
    await drawing.fill("Escalation", HAZARD)
    await drawing.fill("Code", "HAZARD_DETECTED")
    x, y = await drawing.centre(caught)
    await drawing.drag(f"{caught}_label", x + 65, y + 25)
    x, _ = await drawing.centre(ask)
    reverse = await drawing.block("Reverse", x + 6, 600, "REVERSE")
    await drawing.fill("Distance", "10 m")
    await drawing.who("evsg1")
    await drawing.connect(caught, reverse)
    await drawing.connect(reverse, ask)
    await drawing.connect(decide, end)
    await drawing.condition(decide, call, "user.decision == 'continue'", "continue")
    await drawing.condition(decide, end, "user.decision == 'abort'", "abort")
    return Mission(ask, decide, call, caught, reverse, end)


async def draw_detection(drawing: Drawing) -> None:
    """The process that is called: drive along the route while a detector looks for hazards."""
    page = drawing.page
    await page.get_by_role("button", name="Add a process").click()
    await page.get_by_label("Name of the process").fill("DETECTION")
    await page.get_by_role("dialog").get_by_role("button", name="Add a process").click()
    await expect(page.get_by_role("tab", name="DETECTION")).to_have_attribute(
        "aria-selected", "true"
    )
    await drawing.fill("Id", "DETECTION")
    start = await drawing.palette("Create start event", 370, 420)
    fork = await drawing.append(start, "Parallel gateway")
    detector = await drawing.append(fork, "Detector", "DETECTOR")
    await drawing.drag(detector, 600, 560)
    source = await drawing.append(detector, "Exclusive gateway", "Source?")
    # Lower, so that the way back does not lie on the way there.
    x, y = await drawing.centre(source)
    await drawing.drag(source, x + 20, y + 110)
    throw = await drawing.append(source, "Signal intermediate throw event", "stop")
    await drawing.fill("Signal", STOP)
    x, _ = await drawing.centre(detector)
    drive = await drawing.block("Single vehicle routing", x, 290, "DRIVE ROUTE")
    await drawing.fill("Route", "route_alpha")
    await drawing.who("evsg1")
    await drawing.connect(fork, drive)
    driven = await drawing.append(drive, "Terminate end event", "route driven")
    x, y = await drawing.centre(drive)
    stopped = await drawing.create("Signal boundary event", x, y + 40, "stop")
    await drawing.fill("Signal", STOP)
    x, y = await drawing.centre(stopped)
    await drawing.drag(f"{stopped}_label", x + 45, y + 20)
    stop = await drawing.append(stopped, "Drive stop", "DRIVE STOP")
    await drawing.who("evsg1")
    await drawing.drag(stop, 740, 420)
    join = await drawing.append(stop, "Parallel gateway")
    x, _ = await drawing.centre(join)
    await drawing.drag(throw, x, (await drawing.centre(throw))[1])
    await drawing.connect(throw, join)
    detected = await drawing.append(join, "Escalation end event", "hazard detected")
    await drawing.fill("Escalation", HAZARD)
    await drawing.drag(driven, (await drawing.centre(detected))[0], 290)
    await drawing.condition(source, throw, "detection.type == 'gpr'", "gpr")
    await drawing.connect(source, detector)
    x, y = await drawing.centre(detector)
    # Beside the menu of the flow, which lies next to its end.
    await drawing.bend(source, detector, x + 128, y, (await drawing.centre(source))[1])
    await drawing.condition(source, detector, "detection.type != 'gpr'", "other")
