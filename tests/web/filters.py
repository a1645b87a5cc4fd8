"""In: the screen with a finished scan, and a browser that shows the screen. Out: failure if a filter changes the cells that
remain, cannot be undone, or is lost on reload, or if the filtered scan differs from that of the command line.
Frame and unit: mm, cells."""

import array
import filecmp
import os
import subprocess

from shots import quiet


def heights(s, scan):
    """Heights of a scan with the current filters."""
    status, _, data = s.ask("GET", f"/api/v1/scans/{scan}/map/height")
    assert status == 200, status
    return array.array("f", data)


def left(b):
    return int(b.run("return document.querySelector('.sieve').dataset.left"))


def filtered(program, s, b, shot):
    scan = next(j for j in s.json("GET", "/jobs") if j["order"]["procedure"] == "scan")["id"]
    whole = heights(s, scan)
    seen = sum(v == v for v in whole)
    b.page("station")
    b.page("surface")
    b.until("the filters", "return document.querySelector('.sieve')?.dataset.left")
    assert left(b) == seen, (left(b), seen)
    # The clean surface has no small islands, so that the limit is raised until blocks and bottoms of holes are islands.
    b.run("document.querySelector('.sieve input').value = 300")
    b.click("[data-filter=islands]")
    b.until("fewer cells", "return Number(document.querySelector('.sieve').dataset.left) < arguments[0]", seen)
    without = left(b)
    b.click("[data-tool=cut]")
    b.drag(".map canvas", (0.45, 0.4), (0.6, 0.6))
    b.until("a hole", "return Number(document.querySelector('.sieve').dataset.left) < arguments[0]", without)
    holed = left(b)
    now = heights(s, scan)
    assert all(n == w or n != n for n, w in zip(now, whole)), "a filter changed a height"
    assert sum(n == n for n in now) == holed < without < seen
    shot(b, "filters")
    b.reload("surface")
    assert int(b.until("the filters again", "return document.querySelector('.sieve')?.dataset.left")) == holed, "reload lost a filter"
    b.click("#undo-filter")
    b.until("what was cut out", "return Number(document.querySelector('.sieve').dataset.left) === arguments[0]", without)
    b.click("#three")
    b.until("points", "return document.querySelector('[data-shown]')?.dataset.shown > 1000")
    b.click("#save-filtered")
    b.until("a scan of its own", "return /-filter/.test(document.querySelector('select')?.selectedOptions[0]?.textContent ?? '')")
    job = next(j for j in s.json("GET", "/jobs") if j["order"]["procedure"] == "filter")
    own = heights(s, job["id"])
    assert sum(v == v for v in own) == without and all(n == w or n != n for n, w in zip(own, whole))
    first = s.json("GET", f"/jobs/{scan}")["outcome"]
    assert 100 < job["outcome"]["points"] < first["points"], (job["outcome"]["points"], first["points"])
    # The command line makes the same filtered scan.
    jobs = os.path.join(os.path.dirname(s.station), "station", "jobs")
    islands = job["order"]["filters"][0]
    out = os.path.join(os.path.dirname(s.station), "clean")
    done = subprocess.run([program, "--quiet", "filter", os.path.join(jobs, scan, "scan"), "--filter", f"islands:{islands['least_cells']},{islands['step_mm']}", "--out", out], capture_output=True)
    assert done.returncode == 0, done.stderr.decode()
    for name in ("height.tif", "cloud.ply"):
        assert filecmp.cmp(os.path.join(out, name), os.path.join(jobs, job["id"], "scan", name), shallow=False), name
    # Filters that would remove every cell are refused, and the previous filters stay.
    s.json("POST", "/lease", {"firmly": True})
    status, _, said = s.ask("PUT", f"/api/v1/scans/{scan}/filters", {"filters": [{"filter": "heights", "low_mm": 1e6, "high_mm": 2e6}]})
    assert status == 409 and b"no cell is left" in said, (status, said)
    status, _, said = s.ask("PUT", f"/api/v1/scans/{scan}/filters", {"filters": [{"filter": "sigma", "most_mm": -1}]})
    assert status == 400, (status, said)
    assert len(s.json("GET", f"/scans/{scan}/filters")["filters"]) == 1
    s.json("PUT", f"/scans/{scan}/filters", {"filters": []})
    s.json("POST", "/lease/release")
    assert sum(v == v for v in heights(s, scan)) == seen
    # The tests that follow use the unfiltered scan.
    s.json("POST", "/lease")
    s.json("DELETE", f"/jobs/{job['id']}")
    s.json("POST", "/lease/release")
    print(f"filters: {seen - without} of {seen} cells in islands, {without - holed} cut out and back")
    quiet(b, "filters")
