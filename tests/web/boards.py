"""In: the screen with a simulated recording of a board in known poses, and a browser that shows the screen. Out: failure
if the page shows wrong corners or a wrong tilt of a board.
Frame and unit: px, degrees."""

import json
import math
import os

from shots import quiet


def lean(pose):
    """Tilt of the board: how far the side that faces the camera is turned to the right and down, degrees."""
    n = [pose[2], pose[6], pose[10]]
    side = -math.copysign(1, n[2])
    return [math.degrees(math.atan2(side * v, abs(n[2]))) for v in n[:2]]


def boards(s, b, folder, shot):
    with open(os.path.join(folder, "intrinsics", "truth.json")) as f:
        truth = json.load(f)["camera_T_board"]
    views = [s.json("GET", f"/view?recording=intrinsics&frame={i}") for i in range(len(truth))]
    seen = [(v, lean(t)) for v, t in zip(views, truth) if v["corners"]]
    assert len(seen) > 0.8 * len(truth), len(seen)
    off = max(math.dist(v["lean_deg"], t) for v, t in seen)
    assert off < 1.0, f"a board leans {off:.2f} degrees otherwise"
    b.page("calibrate")
    b.click("[data-target=camera]")
    b.until("all pictures", "return Number(document.querySelector('[data-views]')?.dataset.views) === arguments[0]", len(seen))
    # The gauges ignore pictures without a board, and the last of these may appear after the gauges are complete.
    b.until("every picture's corners", "return document.querySelectorAll('.thumb .over').length === arguments[0]", len(views))
    shown = b.run("return [...document.querySelectorAll('.thumb .over')].map((e) => e.querySelectorAll('circle').length)")
    assert shown == [len(v["corners"]) for v in views], shown
    cells = {(int((x + 0.5) / v["width"] * 8), int((y + 0.5) / v["height"] * 6)) for v, _ in seen for x, y in v["corners"]}
    covered = float(b.run("return document.querySelector('[data-covered]').dataset.covered"))
    assert abs(covered - len(cells) / 48) < 1e-3, (covered, len(cells) / 48)
    assert b.run("return document.querySelectorAll('.gauges .next').length") == 2
    shot(b, "calibrate")
    # An excluded picture covers no cell.
    b.click(".thumb")
    b.until("one less", "return Number(document.querySelector('[data-views]')?.dataset.views) === arguments[0]", len(seen) - bool(views[0]["corners"]))
    print(f"boards: {len(seen)} of {len(truth)} pictures, {100 * covered:.0f} % covered, leans within {off:.2f} degrees of the truth")
    quiet(b, "calibrate")
