"""The editor as a whole: it loads soon, and the mark of its makers is seen."""

import pytest
from web_desk import IN_ONE_LOOP, Desk

pytestmark = IN_ONE_LOOP


async def test_the_mark_of_bpmn_io_is_seen_whole(desk: Desk) -> None:
    page = await desk.edit("mehds_vignette_4")
    await page.get_by_role("button", name="Overview").click()
    covered = await page.evaluate(
        """() => {
          const mark = document.querySelector(".bjs-powered-by");
          const { left, right, top, bottom } = mark.getBoundingClientRect();
          const points = [[left + 3, top + 3], [right - 3, top + 3], [left + 3, bottom - 3],
                          [right - 3, bottom - 3], [(left + right) / 2, (top + bottom) / 2]];
          return points.filter(([x, y]) => !mark.contains(document.elementFromPoint(x, y)));
        }"""
    )
    assert covered == []


@pytest.mark.long
async def test_the_first_load_of_the_editor_is_small(desk: Desk) -> None:
    page = desk.page
    session = await page.context.new_cdp_session(page)
    await session.send("Network.enable")
    await session.send("Network.setCacheDisabled", {"cacheDisabled": True})
    received: list[float] = []
    session.on("Network.loadingFinished", lambda event: received.append(event["encodedDataLength"]))
    await desk.edit("vignette1", page)
    await page.wait_for_load_state("networkidle")
    assert sum(received) < 485_000
