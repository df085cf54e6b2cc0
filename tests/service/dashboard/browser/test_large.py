"""A week of twelve satellites with 2,000 targets: drawing goes with pixels, not with actions."""

from __future__ import annotations

import httpx

from tests.service.dashboard.browser.conftest import Browser
from tests.service.dashboard.browser.missions import large_mission, planned

MOVES = """
const [done] = arguments;
const canvas = document.querySelector("#gantt canvas");
const bars = [];
const painted = async (act) => {
  const before = canvas.dataset.drawn;
  act();
  while (canvas.dataset.drawn === before) await new Promise(requestAnimationFrame);
  bars.push(Number(canvas.dataset.bars));
};
(async () => {
  const right = "ArrowRight";
  for (const key of ["+", "+", "+", right, right, "ArrowLeft", "-", "+", "+", "Home"]) {
    await painted(() => canvas.dispatchEvent(new KeyboardEvent("keydown", { key })));
  }
  done(bars);
})();
"""
KINDS = 5  # collects, slews, contacts, sun-pointing, eclipses


def test_a_large_timeline_is_shown_whole_and_moved_through(
    browser: Browser, api: httpx.Client
) -> None:
    job = planned(api, large_mission(api))
    browser.open(f"/jobs/{job['id']}")
    path = browser.wait_for_answer()
    timeline = api.get(f"{path}/timeline").json()
    num_actions = sum(len(one["actions"]) for one in timeline["satellites"])
    assert num_actions > 4000
    bars = browser.driver.execute_async_script(MOVES)
    assert len(bars) == 10  # each move was drawn
    width = browser.run("return document.querySelector('#gantt canvas').clientWidth")
    assert min(bars) > 0
    assert max(bars) <= KINDS * len(timeline["satellites"]) * width
    # The busiest satellite has more actions than its lanes have pixels: some share a pixel.
    assert bars[-1] < num_actions + sum(len(one["eclipses"]) for one in timeline["satellites"])
    browser.click("#tables > details:nth-of-type(1) > summary")
    browser.wait(lambda: "of 2000" in browser.text("#tables .pager"))
