"""In: the program, a simulated station, a browser. Out: failure if the pages Touch, Station, Surface, Part, Scan and Health do
not do what an operator expects: a correct square pose, frames and links in the checks, recipes from drawings and grids,
constructed points, pictures in the support file only if the box is ticked.
Frame and unit: mm, degrees."""

import json
import math
import os
import sys
import tempfile

import plan
from browser import Browser
from server import Server
from shots import quiet

program, folder = sys.argv[1:3]
# A tool 120 mm before the flange. Its z points back to the flange, against the insertion, and is tilted by 3 degrees about x.
LEAN = math.radians(183)
TOOL = [1, 0, 0, 5, 0, math.cos(LEAN), -math.sin(LEAN), -2, 0, math.sin(LEAN), math.cos(LEAN), 120, 0, 0, 0, 1]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def touch(s, b):
    """The proposed pose is square to the touched surface, keeps the tool's position, and needs the smallest rotation."""
    b.page("touch")
    b.click("#touch")
    b.until("a proposal", "return document.querySelectorAll('[data-square] .figure').length >= 12")
    o = next(j for j in s.json("GET", "/jobs") if j["order"]["procedure"] == "touch")["outcome"]
    q, normal = o["square"], o["surface"]["normal"]
    assert q["convention"] == "matrix", q["convention"]
    tool, flange = q["tool"], q["flange"]
    z = [tool[k] for k in (2, 6, 10)]
    assert math.degrees(math.acos(min(1, dot(z, normal)))) < 1e-3, (z, normal)
    # The reported flange pose with the tool gives the reported tool pose.
    made = [[sum(flange[4 * i + k] * TOOL[4 * k + j] for k in range(4)) for j in range(4)] for i in range(3)]
    assert all(abs(made[i][j] - tool[4 * i + j]) < 1e-5 for i in range(3) for j in range(4)), (made, tool)
    # The pose before, from the recording.
    with open(os.path.join(folder, "surface", "poses.json")) as f:
        poses = json.load(f)
    last = poses["poses"][-1] if isinstance(poses, dict) else poses[-1]
    last = last if isinstance(last, list) else next(v for v in last.values() if isinstance(v, list))
    stood = [[sum(last[4 * i + k] * TOOL[4 * k + j] for k in range(4)) for j in range(4)] for i in range(3)]
    assert max(abs(stood[i][3] - tool[4 * i + 3]) for i in range(3)) < 1e-3, "the tool's tip moved"
    leant = math.degrees(math.acos(dot([stood[i][2] for i in range(3)], normal)))
    assert abs(leant - q["tilt_deg"]) < 1e-3 and 0 < q["tilt_sigma_deg"] < 1, (leant, q)
    turn = sum(stood[i][j] * tool[4 * i + j] for i in range(3) for j in range(3))
    assert abs(math.degrees(math.acos(min(1, (turn - 1) / 2))) - leant) < 1e-3, "it turns by more than it leans"
    print(f"touch: leant {leant:.3f} degrees, known to {q['tilt_sigma_deg']:.3f}; square to {math.degrees(math.acos(min(1, dot(z, normal)))):.1e}")
    quiet(b, "touch")


def station(s, b):
    b.page("station")
    shown = b.until("the tool", "return document.querySelector('[data-frame=tool]')?.innerText")
    assert "120.000" in shown, shown
    info = s.json("GET", "/station")
    assert info["work_frame"] == "base" and {f["name"] for f in info["frames"]} == {"tool", "camera"}, info["frames"]
    b.click("#check")
    b.until("the checks", "return [...document.querySelectorAll('.light')].some((e) => e.innerText.includes('picture size'))")
    lines = {(x["group"], x["name"]): x for x in next(j for j in s.json("GET", "/jobs") if j["order"]["procedure"] == "check")["outcome"]["lines"]}
    assert lines["camera", "camera"]["state"] == "good" and lines["camera", "picture size"]["state"] == "good", lines
    assert lines["robot", "robot"]["state"] == "absent", lines["robot", "robot"]
    quiet(b, "station")


# Mean brightness of the map, once it is equal in two successive frames of the page.
BRIGHTNESS = """
  const c = document.querySelector('.map canvas'), now = () => {
    const d = c.width ? c.getContext('2d').getImageData(0, 0, c.width, c.height).data : [];
    let n = 0;
    for (let i = 0; i < d.length; i += 4) n += d[i] + d[i + 1] + d[i + 2];
    return n / d.length || 0;
  };
  return new Promise((stands) => {
    let before = 0;
    const look = () => { const v = now(); if (v > 5 && v === before) return stands(v); before = v; requestAnimationFrame(look); };
    requestAnimationFrame(look);
  });"""


def brightness(b, layer):
    """Mean brightness of the map once it shows this layer."""
    b.until(f"layer {layer}", "return document.querySelector(`[data-layer=${arguments[0]}]`).getAttribute('aria-pressed') === 'true'", layer)
    b.place(".map canvas")
    return b.run(BRIGHTNESS)


def surface(s, b):
    b.page("surface")
    b.until("the map", "return document.querySelector('.map canvas')?.width > 300")
    height = brightness(b, "height")
    b.click("[data-layer=both]")
    # Nearly everywhere the intensity is below its maximum, so that this layer is darker.
    both = brightness(b, "both")
    assert 0.2 * height < both < 0.95 * height, (height, both)
    quiet(b, "surface")


def dxf(unit=4):
    """A drawing (DXF) of a body with two rows of contacts."""
    out = ["0", "SECTION", "2", "HEADER", "9", "$INSUNITS", "70", str(unit), "0", "ENDSEC", "0", "SECTION", "2", "ENTITIES"]
    out += ["0", "LWPOLYLINE", "8", "0", "90", "4", "70", "1"]
    for x, y in ((-15.24, -8.89), (15.24, -8.89), (15.24, 8.89), (-15.24, 8.89)):
        out += ["10", str(x), "20", str(y)]
    for i in range(12):
        for y in (-7.62, 7.62):
            out += ["0", "CIRCLE", "8", "0", "10", str((i - 5.5) * 2.54), "20", str(y), "40", "0.72"]
    return "\n".join(out + ["0", "ENDSEC", "0", "EOF", ""])


def part(s, b):
    """A drawing becomes a recipe whose part is found. Points are constructed from its grid, and one is chosen for the tool."""
    b.page("part")
    b.until("the map", "return document.querySelector('.map canvas')?.width > 300")
    script = """const [text, name] = arguments, e = document.getElementById('drawing'), d = new DataTransfer();
        d.items.add(new File([text], name)); e.files = d.files; e.dispatchEvent(new Event('change'))"""
    b.run(script, dxf(0), "without a unit.dxf")
    b.click("#make-recipe")
    b.until("that the unit is not known", "return /unit/.test(document.querySelector('.problem')?.innerText ?? '')")
    b.run(script, dxf(), "socket.dxf")
    # The page reads the file asynchronously; until then a recipe would be made from the previous drawing.
    b.until("the other drawing", "return document.getElementById('drawing-name').value === 'socket'")
    b.click("#make-recipe")
    b.until("a part that was found by its drawing", "return /score/.test(document.getElementById('main').innerText) && document.querySelector('[data-point]')")
    job = next(j for j in s.json("GET", "/jobs") if j["order"]["procedure"] == "find")
    assert job["order"]["recipe"] == "socket", job["order"]
    with open(os.path.join(folder, "scan", "truth.json")) as f:
        led = next(p["base_T_part"] for p in json.load(f)["parts"] if p["name"] == "led")
    found = job["outcome"]["part"]
    off = math.dist([led[k] for k in (3, 7, 11)], [found[k] for k in (3, 7, 11)])
    assert off < 0.1, f"the drawing's part lies {off:.3f} mm beside the truth"
    recipe = next(r for r in s.json("GET", "/recipes") if r["name"] == "socket")
    points = s.json("POST", "/points", {"text": recipe["text"]})
    grid = next(p["name"] for p in points if p["kind"] == "grid")
    assert sum(p["kind"] == "shape" and p["name"].startswith(grid) for p in points) == 24, points
    # The midpoint of the two corner pins, chosen for the tool.
    choose = "const e = [...document.querySelectorAll('select')].find((x) => x.previousElementSibling?.innerText === arguments[0]); e.value = arguments[1]; e.dispatchEvent(new Event('change'))"
    b.run(choose, "Of", f"{grid}[1,1]")
    b.run(choose, "and", f"{grid}[12,2]")
    b.run("document.getElementById('point-name').value = 'middle'")
    b.click("#add-point")
    b.until("the point", "return document.querySelector('[data-point=middle]')")
    # The choice is complete when the server has changed the text and the page has redrawn the list.
    b.run("const e = document.querySelector('[aria-label=\"Tool goes to middle\"]'); e.former = true; e.click()")
    b.until("that it is chosen", "const e = document.querySelector('[aria-label=\"Tool goes to middle\"]'); return e?.checked && !e.former")
    text = b.run("return document.querySelector('textarea').value")
    points = {p["name"]: p for p in s.json("POST", "/points", {"text": text})}
    corners = [points[f"{grid}[1,1]"]["at"], points[f"{grid}[12,2]"]["at"]]
    assert points["middle"]["chosen"] and all(abs(points["middle"]["at"][k] - (corners[0][k] + corners[1][k]) / 2) < 1e-9 for k in (0, 1)), points["middle"]
    # An offset along the lattice; the point on which it depends cannot be deleted.
    b.run(choose, "Construct", "offset")
    b.run(choose, "Of", "middle")
    b.run("for (const [id, v] of [['by-along', 2.54], ['by-across', 1]]) { const e = document.getElementById(id); e.value = v; e.dispatchEvent(new Event('input')); }")
    b.run("document.getElementById('point-name').value = 'aside'")
    b.click("#add-point")
    b.until("the offset", "return document.querySelector('[data-point=aside]')")
    points = {p["name"]: p for p in s.json("POST", "/points", {"text": b.run("return document.querySelector('textarea').value")})}
    moved = [points["aside"]["at"][k] - points["middle"]["at"][k] for k in (0, 1)]
    assert abs(math.hypot(*moved) - math.hypot(2.54, 1)) < 1e-6, moved
    b.run("document.querySelector('[aria-label=\"Delete middle\"]').click()")
    b.until("that it is needed", "return /middle/.test(document.querySelector('.problem')?.innerText ?? '')")
    quiet(b, "part", refused=2)


def grid(s, b):
    """Rows, columns and pitch give every hole of a grid, rotated with the part."""
    scan = next(j for j in s.json("GET", "/jobs") if j["order"]["procedure"] == "scan")["id"]
    b.page("station")
    b.page("part")
    b.until("the map", "return document.querySelector('.map canvas')?.width > 300")
    b.click("[data-tool=outline]")
    b.drag(".map canvas", (0.3, 0.3), (0.7, 0.7))
    b.click("[data-tool=grid]")
    b.drag(".map canvas", (0.4, 0.6), (0.41, 0.6))
    b.until("its fields", "return document.getElementById('grid-columns')")
    b.run("for (const [id, v] of [['grid-columns', 3], ['grid-rows', 2], ['grid-x', 2.54], ['grid-y', 15.24]]) { const e = document.getElementById(id); e.value = v; e.dispatchEvent(new Event('input')); }")
    made = b.run("return import('/widgets/part/holegrid.js').then((m) => m.places({ first: [10, 20], radius: 0.7, columns: 3, rows: 2, pitch: [2.54, 15.24] }, 30))")
    assert len(made) == 6 and made[0] == [10, 20, 0.7], made
    far = math.hypot(made[5][0] - 10, made[5][1] - 20)
    assert abs(far - math.hypot(2 * 2.54, 15.24)) < 1e-9, made
    turn = math.degrees(math.atan2(made[2][1] - 20, made[2][0] - 10))
    assert abs(turn - 30) < 1e-9, turn
    b.run("document.getElementById('turn').dispatchEvent(new Event('input'))")
    assert scan
    quiet(b, "grid")


def health(s, b):
    """The support file contains pictures only if the box is ticked."""
    b.page("health")
    address = lambda: b.run("return document.getElementById('support').getAttribute('href')")
    read = lambda: json.loads(s.ask("GET", address())[2])
    assert "pictures" not in read(), "pictures that nobody asked for"
    b.click("#support-pictures")
    pictures = read()["pictures"]
    assert "camera.png" in pictures and any("found.png" in k for k in pictures) and all(v.startswith("iVBOR") for v in pictures.values()), list(pictures)
    b.click("#support-pictures")
    assert "pictures" not in read()
    quiet(b, "health")


def repeat(s, b):
    b.page("scan")
    before = sum(j["order"]["procedure"] == "scan" for j in s.json("GET", "/jobs"))
    b.click("#repeat")
    b.until("one more scan", "return [...document.querySelectorAll('h2')].some((e) => /^\\d+-scan/i.test(e.innerText) && e.innerText.slice(0, 4) > arguments[0])", "0003")
    scans = [j for j in s.json("GET", "/jobs") if j["order"]["procedure"] == "scan"]
    assert len(scans) == before + 1 and scans[0]["order"] == scans[1]["order"] and scans[0]["outcome"]["points"] == scans[1]["outcome"]["points"]
    quiet(b, "repeat")


with open(os.path.join(folder, "station", "station.toml"), "w") as f:
    f.write(f'name = "cell 3"\n\n[tool]\nflange_from_tool = {[float(v) for v in TOOL]}\n')
s = Server(program, folder, "--recordings", folder, "--camera", "sim:3?rate=4")
if not Browser.there():
    print("no chromium and chromedriver here")
    sys.exit(77)
assert s.job({"procedure": "scan", "recording": "scan"})["state"] == "done"
s.json("POST", "/lease/release")
with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
    b = Browser(profile)
    try:
        b.open(s.url)
        b.ready("station")
        touch(s, b)
        station(s, b)
        surface(s, b)
        part(s, b)
        grid(s, b)
        health(s, b)
        # Takes about a minute.
        if os.environ.get("SHEETLIGHT_LONG"):
            plan.health(program, s, b)
        plan.drawn(s, b, "led")
        repeat(s, b)
        plan.batch(program, s, folder)
    finally:
        b.close()
assert s.end() == 0
