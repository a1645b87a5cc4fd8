"""In: the program, a simulated station with known truth, and optionally a folder for screenshots. Out: failure if an operator
cannot go from scan to position with the real pages in a real browser, if a script reports an error, if a text has too
little contrast, or if a control has no accessible name.
Frame and unit: mm, degrees, CSS pixels, seconds."""

import json
import math
import os
import sys
import tempfile
import time

import boards
import filters
import settings
import shots
import waits
from browser import Browser
from server import Server
from shots import quiet

program, folder = sys.argv[1:3]
pictures = sys.argv[3] if len(sys.argv) > 3 else None
shot = lambda b, name: shots.shot(b, pictures, name)
PAGES = ["station", "picture", "calibrate", "touch", "scan", "surface", "part", "position", "replay", "health", "settings"]

# Finds text with less contrast than WCAG 2.2 AA requires (4.5, large text 3), and controls that are too small or unnamed.
CONTRAST = """
const parse = (c) => { const m = /rgba?\\(([^)]+)\\)/.exec(c); const v = m[1].split(/[ ,/]+/).map(Number); return v.length > 3 ? v : [...v, 1]; };
const lin = (v) => (v /= 255) <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
const lum = ([r, g, b]) => 0.2126 * lin(r) + 0.7152 * lin(g) + 0.0722 * lin(b);
const over = (a, b) => [0, 1, 2].map((i) => a[i] * a[3] + b[i] * (1 - a[3])).concat(1);
const ground = (e) => { const up = []; for (; e; e = e.parentElement) { const c = parse(getComputedStyle(e).backgroundColor); up.push(c); if (c[3] === 1) break; } return up.reverse().reduce((b, c) => over(c, b), [255, 255, 255, 1]); };
const bad = [];
const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
while (walk.nextNode()) {
  const e = walk.currentNode.parentElement;
  if (!walk.currentNode.textContent.trim() || !e.checkVisibility() || e.closest('svg, canvas, option, :disabled, .map, .skip, noscript')) continue;
  const s = getComputedStyle(e), b = ground(e), f = over(parse(s.color), b);
  const [x, y] = [lum(f), lum(b)].sort((p, q) => q - p), ratio = (x + 0.05) / (y + 0.05);
  const large = parseFloat(s.fontSize) >= 24 || (parseFloat(s.fontSize) >= 18.66 && Number(s.fontWeight) >= 700);
  if (ratio < (large ? 3 : 4.5)) bad.push(`${ratio.toFixed(2)}: "${e.textContent.trim().slice(0, 40)}" ${s.color}`);
}
for (const e of document.querySelectorAll('button, a, input, select, textarea, canvas, [role=img]')) {
  if (!e.checkVisibility() || e.closest('[aria-hidden=true]')) continue;
  const name = e.getAttribute('aria-label') ?? e.innerText?.trim() ?? '';
  const label = e.labels?.length ? e.labels[0].innerText.trim() : '';
  if (e.hasAttribute('aria-label') ? false : !name && !label) bad.push(`no name: ${e.outerHTML.slice(0, 120)}`);
  const r = e.getBoundingClientRect();
  if (e.matches('button, select, #nav a') && (r.height < 24 || r.width < 24)) bad.push(`too small to press, ${r.width}x${r.height}: ${e.outerHTML.slice(0, 90)}`);
}
return bad;
"""


def usable(b):
    """The first page is usable within a second of its request. Other programs may slow a load, so that the page is loaded
    until one load is fast enough, for at most a minute."""
    times, end = [], time.monotonic() + 60
    while not times or (times[-1] >= 1000 and time.monotonic() < end):
        b.reload("station")
        times.append(b.run("return performance.getEntriesByName('usable')[0].startTime"))
    print(f"the first page is usable after {min(times):.0f} ms (loads: {', '.join(f'{x:.0f}' for x in times)})")
    assert min(times) < 1000, times


def insertion(s, b):
    """An operator goes from the first page to the position in a recording; the pose is compared with the truth."""
    b.open(s.url)
    b.ready("station")
    assert "token" not in b.run("return location.href"), "the token stays in the address"
    size = b.run("return performance.getEntries().filter((e) => e.transferSize).reduce((a, e) => a + e.transferSize, 0)")
    assert 10_000 < size < 300_000, f"the first page takes {size} bytes"
    usable(b)
    b.run("localStorage.theme = 'dark'")
    b.reload("station")
    begun, b.clicks = time.time(), 0
    b.page("scan")
    b.click("#start")
    b.until("a growing map", "return [...document.querySelectorAll('.map .read, .small')].some((e) => /rows/.test(e.textContent))")
    b.click("#to-surface")
    b.ready("surface")
    shot(b, "surface")
    b.page("part")
    b.until("recipes", "return document.querySelectorAll('select').length > 1")
    b.run("const s = document.querySelectorAll('select')[1]; s.value = 'led'; s.dispatchEvent(new Event('change'))")
    b.clicks += 1
    b.click("#find")
    b.click("#to-position")
    b.ready("position")
    b.until("the map", "return document.querySelector('.map canvas')")
    shot(b, "position")
    print(f"scan to position: {b.clicks} clicks, {time.time() - begun:.1f} s")
    assert b.clicks <= 8, f"{b.clicks} clicks"
    shown = [float(x) for x in b.run("return [...document.querySelectorAll('.found-pose .figure b')].map((e) => e.innerText)")]
    job = next(j for j in s.json("GET", "/jobs") if j["order"]["procedure"] == "find")
    approach = job["outcome"]["poses"]["approach"]
    assert all(abs(a - v) < 1e-3 for a, v in zip(shown, approach)) and len(shown) == 6, (shown, approach)
    b.click("[data-goal=insertion]")
    b.click("#three")
    b.until("the part over the points", "const d = document.querySelector('[data-shown]')?.dataset; return Number(d?.outlines) > 3 && Number(d?.shown) > 1000")
    shot(b, "position-cloud")
    with open(os.path.join(folder, "scan", "truth.json")) as f:
        part = next(p["base_T_part"] for p in json.load(f)["parts"] if p["name"] == "led")
    found = job["outcome"]["part"]
    off = math.dist([part[k] for k in (3, 7, 11)], [found[k] for k in (3, 7, 11)])
    print(f"the part is {off:.4f} mm from the truth")
    assert off < 0.08, f"{off} mm"
    quiet(b, "insertion")
    return job


def surface(s, b):
    """A section over the edge of a socket, the distance of two points, a point above a plane, each with sigma; the 3-D view."""
    b.page("surface")
    b.until("the map", "return document.querySelector('.map canvas')?.width > 300")
    for tool, words in (("section", "Section"), ("points", "Distance")):
        b.click(f"[data-tool={tool}]")
        b.drag(".map canvas", (0.4, 0.45), (0.6, 0.55))
        b.until(words, "return document.getElementById('main').innerText.includes(arguments[0] + ' ') && /±|mm/.test(document.getElementById('main').innerText.split('MEASURED')[1])", words)
    b.until("a curve", "return document.querySelector('.plot .curve')")
    b.drag(".plot", (0.2, 0.5), (0.3, 0.5))
    b.until("a fitted line", "return document.querySelector('.plot .fit')")
    # A second piece with the keyboard only: arrows move to its ends, Enter sets them.
    b.run("document.querySelector('svg.plot[tabindex]').focus()")
    b.keys(*["\ue014"] * 10, "\ue007", *["\ue014"] * 12, "\ue007")
    b.until("a second fitted line", "return document.querySelectorAll('.plot .fit').length === 2")
    b.click("[data-tool=plane]")
    b.drag(".map canvas", (0.3, 0.3), (0.7, 0.7))
    b.drag(".map canvas", (0.5, 0.5), (0.5, 0.5))
    b.until("a height over a plane", "return /Above the plane .*±/.test(document.body.innerText)")
    shot(b, "measure")
    # With the keyboard only: arrows move the cross, Enter sets the two points.
    b.click("[data-tool=points]")
    before = b.text("#main").count("Distance")
    b.run("document.querySelector('.map canvas').focus()")
    b.keys("\ue012", "\ue007", "\ue013", "\ue013", "\ue007")
    b.until("a distance by keyboard", "return (document.getElementById('main').innerText.match(/Distance/g) ?? []).length > arguments[0]", before)
    b.click("#three")
    # During a rotation as many points are drawn as this machine can, and all of them when the view rests.
    b.until("points", "return Number(document.querySelector('[data-shown]')?.dataset.shown) > 5000")
    b.drag("[data-shown] canvas", (0.4, 0.4), (0.6, 0.5))
    b.drag("[data-shown] canvas", (0.5, 0.55), (0.5, 0.55))
    b.until("a picked point with its sigma", "return /σ 0\\.\\d+/.test(document.querySelector('[data-shown] .read').innerText)")
    shot(b, "cloud")
    quiet(b, "surface")


def teach(s, b):
    """Teaches a new part from a box drawn around the socket, then finds it with its recipe. The fault of a broken recipe is shown
    beside the recipe."""
    scan = next(j for j in s.json("GET", "/jobs") if j["order"]["procedure"] == "scan")["id"]
    found = next(j for j in s.json("GET", "/jobs") if j["order"]["procedure"] == "find")["outcome"]
    head = s.json("GET", f"/scans/{scan}/map")
    grid, part = head["base_from_grid"], found["part"]
    dot = lambda a, b, i, j: sum(a[4 * k + i] * b[4 * k + j] for k in range(3))
    centre = [sum(grid[4 * k + i] * (part[4 * k + 3] - grid[4 * k + 3]) for k in range(3)) for i in (0, 1)]
    turn = math.degrees(math.atan2(dot(grid, part, 1, 0), dot(grid, part, 0, 0)))
    b.page("part")
    b.until("the map", "return document.querySelector('.map canvas')?.width > 300")
    b.click("[data-tool=outline]")
    # Position of the box on the canvas: the map is fitted into the canvas and centred.
    w, h = b.place(".map canvas")[2:]
    size = [head["width"] * head["cell_mm"], head["height"] * head["cell_mm"]]
    k = min(w / size[0], h / size[1]) * 0.97
    at = lambda x, y: (0.5 + k * (x - size[0] / 2) / w, 0.5 - k * (y - size[1] / 2) / h)
    (x, y), (half, deep) = centre, (15.24, 8.89)
    b.drag(".map canvas", at(x - half, y + deep), at(x + half, y - deep))
    b.until("what was drawn", "return document.getElementById('teach')")
    b.run("const e = document.getElementById('turn'); e.value = arguments[0]; e.dispatchEvent(new Event('input'))", f"{turn:.2f}")
    b.click("[data-tool=window]")
    for along in (-7.12, 7.12):
        u, v = x + along * math.cos(math.radians(turn)), y + along * math.sin(math.radians(turn))
        b.drag(".map canvas", at(u - 5.52, v + 6.2), at(u + 5.52, v - 6.2))
    shot(b, "teach")
    wide, high = (float(v) for v in b.run("return /([\\d.]+) × ([\\d.]+)/.exec(document.getElementById('main').innerText).slice(1)"))
    assert abs(wide - 2 * half) < 0.6 and abs(high - 2 * deep) < 0.6, (wide, high)
    b.click("#teach")
    b.until("a taught part", "return /part: found/.test(document.getElementById('main').innerText)")
    taught = next(j for j in s.json("GET", "/jobs") if j["order"]["procedure"] == "teach")["outcome"]["proof"]
    assert taught["passed"], taught["reasons"]
    b.page("settings")
    b.page("part")
    b.until("the recipe", "return document.querySelector('textarea')")
    b.run("document.querySelector('textarea').value = 'format = 1\\nname = \"x\"\\ncell_mm = \"wide\"\\n'")
    stored = lambda: next(r["text"] for r in s.json("GET", "/recipes") if r["name"] == "part")
    before = stored()
    b.click("#save-recipe")
    b.until("the question", "return document.querySelector('#save-recipe').innerText === 'Really replace it?'")
    assert stored() == before, "it was replaced without being asked for twice"
    b.click("#save-recipe")
    b.until("the line of a broken recipe", "return /line 3|cell_mm/.test(document.querySelector('.problem')?.innerText ?? '')")
    # A correct text replaces the recipe at the second press, and a backup contains the previous text.
    b.run("document.querySelector('textarea').value = arguments[0]", "# mine\n" + before)
    b.click("#save-recipe")
    b.click("#save-recipe")
    b.until("saved", "return /Saved/.test(document.getElementById('main').innerText)")
    assert stored() == "# mine\n" + before
    kept = s.json("GET", "/settings")["backups"]
    assert len(kept) == 1 and kept[0]["name"].endswith("before-recipe.json"), kept
    _, _, data = s.ask("GET", f"/api/v1/backups/{kept[0]['name']}")
    assert json.loads(data)["files"]["recipes/part.toml"] == before
    # Teaching again under the same name is refused before anything is measured, unless `replace` is set.
    order = next(j for j in s.json("GET", "/jobs") if j["order"]["procedure"] == "teach")["order"]
    s.json("POST", "/lease", {"firmly": True})
    refused = s.job({**order, "replace": False})
    assert refused["state"] == "failed" and "already" in refused["problem"]["what"] and stored() == "# mine\n" + before, refused
    again = s.job({**order, "replace": True})
    assert again["state"] == "done" and stored() == before, again
    assert len(s.json("GET", "/settings")["backups"]) == 2
    s.json("POST", "/lease/release")
    quiet(b, "teach", refused=1)


# Opposite contacts of data/recipes/led.toml, in the part frame, mm.
PINS = ((-5.5 * 2.54, -7.62), (5.5 * 2.54, 7.62))


def pins(s, b):
    """Two clicks on pins: the tool goes to their midpoint, with the sigma of two pins. A click beside all pins is reported."""
    scan = next(j for j in s.json("GET", "/jobs") if j["order"]["procedure"] == "scan")["id"]
    former = next(j for j in s.json("GET", "/jobs") if j["order"]["procedure"] == "find")["outcome"]
    head = s.json("GET", f"/scans/{scan}/map")
    grid, part = head["base_from_grid"], former["part"]

    def on_map(x, y):
        base = [part[4 * k] * x + part[4 * k + 1] * y + part[4 * k + 3] - grid[4 * k + 3] for k in range(3)]
        return [sum(grid[4 * k + i] * base[k] for k in range(3)) for i in (0, 1)]

    b.page("part")
    b.until("the map", "return document.querySelector('.map canvas')?.width > 300")
    b.run("const s = document.querySelectorAll('select')[1]; s.value = 'led'; s.dispatchEvent(new Event('change'))")
    size = [head["width"] * head["cell_mm"], head["height"] * head["cell_mm"]]

    def click(place):
        # A message above the map makes the map smaller, so that its size is read before each click.
        w, h = b.place(".map canvas")[2:]
        k = min(w / size[0], h / size[1]) * 0.97
        at = (0.5 + k * (place[0] - size[0] / 2) / w, 0.5 - k * (place[1] - size[1] / 2) / h)
        b.drag(".map canvas", at, at)

    b.click("[data-tool=pins]")
    click(on_map(*PINS[0]))
    click(on_map(PINS[1][0] + 6, PINS[1][1] + 6))
    b.until("that no pin lies there", "return /no pin lies within/.test(document.querySelector('.problem')?.innerText ?? '')")
    b.click("[data-tool=pins]")
    b.clicks = 0
    click(on_map(*PINS[0]))
    click(on_map(*PINS[1]))
    b.ready("position")
    b.until("the position", "return document.querySelector('.found-pose')")
    assert b.clicks == 2, b.clicks
    job = next(j for j in s.json("GET", "/jobs") if j["order"].get("pins") and j["state"] == "done")
    found = job["outcome"]
    assert found["passed"] and any("middle of pin[1,1], pin[12,2]" in n for n in found["notes"]), found["notes"]
    term = next(t for t in found["terms"] if t["name"] == "construction")
    assert 0.01 < term["sigma_mm"][0] < 0.2 and all(found["sigma_mm"][i] >= term["sigma_mm"][i] for i in (0, 1)), term
    assert found["sigma_mm"][0] > former["sigma_mm"][0], (found["sigma_mm"], former["sigma_mm"])
    moved = math.dist(found["poses"]["insertion"][:3], former["poses"]["insertion"][:3])
    aside = math.hypot(*found["sigma_mm"][:2])
    assert 1e-4 < moved < 4 * aside, f"two pins say {moved:.4f} mm from what all edges say, sigma {aside:.4f}"
    print(f"two clicks on pins: {moved:.4f} mm from what all edges say, sigma {aside:.4f} mm (all edges {math.hypot(*former['sigma_mm'][:2]):.4f})")
    shot(b, "pins")
    quiet(b, "pins")


def copied(s, b):
    """A copied tab has the operator's name in its session storage, but gets a new name. A reloaded page keeps its name."""
    mine = lambda: b.run("return sessionStorage.tab")
    b.page("station")
    name, here = mine(), b.ask("GET", "/window")
    b.reload("station")
    assert mine() == name, "a page that was loaded again has another name"
    b.run("window.open(location.href)")
    there = waits.until("the other tab", lambda: next((w for w in b.ask("GET", "/window/handles") if w != here), None))
    b.ask("POST", "/window", {"handle": there})
    b.ready("station")
    assert len(mine()) == 16 and mine() != name, "two tabs operate under one name"
    # Chromium 156 sometimes forgets that a request for a lock was given up: one of about 100 copied tabs stayed empty.
    forgets = "const ask = navigator.locks.request.bind(navigator.locks); navigator.locks.request = (name, _, grant) => ask(name, grant);"
    b.ask("POST", "/goog/cdp/execute", {"cmd": "Page.addScriptToEvaluateOnNewDocument", "params": {"source": forgets}})
    b.run("sessionStorage.tab = arguments[0]", name)
    b.reload("station")
    assert len(mine()) == 16 and mine() != name, "two tabs operate under one name where a lock's request is not given up"
    b.ask("DELETE", "/window")
    b.ask("POST", "/window", {"handle": here})
    assert mine() == name
    quiet(b, "copied")


def replay(s, b):
    """Scans the same recording with another setting, and compares it with the previous scan."""
    b.page("replay")
    b.run("const s = [...document.querySelectorAll('select')].at(-1); s.value = 'choose.quality' in s ? s.value : s.value")
    b.run("[...document.querySelectorAll('button')].find((e) => e.innerText === 'Add').click()")
    b.click("#again")
    b.until("a difference", "return /cells in both/.test(document.getElementById('main').innerText)")
    shot(b, "replay")
    # A batch scans and searches the recording again with the other setting. The scatter of the poses is computed here too.
    finds = lambda: [j for j in s.json("GET", "/jobs") if j["order"]["procedure"] == "find" and j["state"] == "done" and not j["order"].get("pins") and j["outcome"]["recipe"] == "led"]
    before = len(finds())
    b.run("const e = [...document.querySelectorAll('select')].find((x) => [...x.options].some((o) => o.value === 'led')); e.value = 'led'; e.dispatchEvent(new Event('change'))")
    b.click("#run-batch")
    b.until("one place more", "return Number(document.querySelector('[data-repeats]')?.dataset.repeats) === arguments[0]", before + 1)
    x = [j["outcome"]["part"][3] for j in finds()]
    mean = sum(x) / len(x)
    scatter = (sum((v - mean) ** 2 for v in x) / (len(x) - 1)) ** 0.5
    shown = float(b.run("return document.querySelector('[data-repeats] tbody td:nth-child(3)').innerText").split()[0])
    assert abs(shown - scatter) < 1e-3, (shown, scatter)
    assert b.run("return document.querySelectorAll('.histogram rect').length") == 60
    print(f"batch: {len(x)} places of one part, {scatter:.4f} mm scatter along x")
    quiet(b, "replay")


def rest(s, b):
    b.page("touch")
    b.click("#touch")
    b.until("a normal", "return /normal, towards the camera/.test(document.getElementById('main').innerText)")
    shot(b, "touch")
    for page in ("station", "picture", "scan", "health", "settings"):
        b.page(page)
        time.sleep(0.3)
        shot(b, page)
        quiet(b, page)
    b.keys("\ue00a")
    b.ask("POST", "/actions", {"actions": [{"type": "key", "id": "k", "actions": [{"type": "keyDown", "value": "\ue00a"}, {"type": "keyDown", "value": "5"}, {"type": "keyUp", "value": "5"}, {"type": "keyUp", "value": "\ue00a"}]}]})
    b.ready("scan")


def legible(b):
    """Every page in both colour themes: contrast and names. Every language: its words from the table, without an error on any page."""
    for theme in ("dark", "light"):
        b.page(PAGES[-1])
        b.run("localStorage.theme = arguments[0]", theme)
        b.reload(PAGES[-1])
        for page in PAGES:
            b.page(page)
            time.sleep(0.15)
            bad = b.run(CONTRAST)
            assert not bad, f"{page}, {theme}:\n" + "\n".join(bad[:12])
            over = b.run("return document.documentElement.scrollWidth - innerWidth")
            assert over <= 0, f"{page} is {over} px wider than the screen"
    b.run("localStorage.theme = 'dark'")
    for language, word in (("de", "Oberfläche"), ("zh", "表面"), ("ja", "表面"), ("en", "Surface")):
        b.run("localStorage.language = arguments[0]", language)
        b.reload(PAGES[-1])
        assert word in b.text("#nav"), language
        if language == "ja":
            b.page("position")
            shot(b, "position-ja")
            b.page(PAGES[-1])
        for page in ("scan", "surface", "part") if language == "de" else ():
            b.page(page)
            assert b.run("return document.documentElement.scrollWidth <= innerWidth"), f"{page} in {language} is wider than the screen"
            b.page(PAGES[-1])
    quiet(b, "languages")


def lost(s, b):
    """After the server is killed, the screen says that the program does not answer."""
    b.page("station")
    s.kill()
    b.until("that the program is gone", "return /does not answer/.test(document.getElementById('bar').innerText)")


def main():
    s = Server(program, folder, "--recordings", folder)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        b = Browser(profile)
        try:
            insertion(s, b)
            surface(s, b)
            filters.filtered(program, s, b, shot)
            teach(s, b)
            pins(s, b)
            copied(s, b)
            replay(s, b)
            rest(s, b)
            boards.boards(s, b, folder, shot)
            legible(b)
            settings.settings(program, s, b, shot)
            lost(s, b)
        finally:
            b.close()
            s.kill()


if not Browser.there():
    print("no chromium and chromedriver here")
    sys.exit(77)
main()
