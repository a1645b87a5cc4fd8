"""In: the screen of a simulated cell whose job has found a part, and a browser that shows the screen. Out: failure if the
part's outlines do not lie on the part in the camera's picture, or if page and command line draw different outlines.
Frame and unit: px, grey levels."""

import json
import os
import struct
import subprocess

import waits

# Shift of the outlines for comparison, px: shifted outlines lie on fewer edges.
ASIDE = 6


def picture(s):
    """The camera's newest picture: number, columns, rows, grey levels."""
    status, _, b = s.ask("GET", "/api/v1/camera/newest?after=0")
    assert status == 200, status
    number, columns, rows, peaks = struct.unpack("<4I", b[:16])
    return number, columns, rows, b[20 + 12 * peaks:]


def steep(lines, columns, rows, grey, du=0, dv=0):
    """Mean change of the grey level across the lines; None if at most 200 sampled points lie in the picture."""
    total, n = 0.0, 0
    for line in lines:
        for (u, v), (x, y) in zip(line, line[1:]):
            length = ((x - u) ** 2 + (y - v) ** 2) ** 0.5
            if length < 1e-6:
                continue
            across = (-(y - v) / length, (x - u) / length)
            steps = max(1, int(length))
            for k in range(steps):
                a, b = u + (x - u) * k / steps + du, v + (y - v) * k / steps + dv
                ends = [(round(a + side * across[0]), round(b + side * across[1])) for side in (-1.5, 1.5)]
                if all(0 <= c < columns and 0 <= r < rows for c, r in ends):
                    one, other = (grey[r * columns + c] for c, r in ends)
                    total, n = total + abs(one - other), n + 1
    return total / n if n > 200 else None


def lies_on_the_part(s, b):
    """Before the approach, the page draws the part's outlines over the picture, and they lie on the picture's edges."""
    job = s.json("GET", "/motion")["asked"]["job"]
    b.until("the part over the picture", "return Number(document.querySelector('canvas.live')?.dataset.ghost) > 0")

    def both():
        """The outlines and the picture, if the page shows the same picture; else None. New pictures arrive at any time, and
        their poses a moment later."""
        number, columns, rows, grey = picture(s)
        status, _, said = s.ask("GET", f"/api/v1/jobs/{job}/ghost?number={number}")
        ghost = json.loads(said)
        lines, shown = b.run("const { ghost, number } = document.querySelector('canvas.live').dataset; return [Number(ghost), Number(number)]")
        return (ghost, lines, columns, rows, grey) if status == 200 and shown == number else None

    ghost, lines, columns, rows, grey = waits.until("one picture at the page and here", both)
    assert ghost["moved_px"] == 0 and lines == len(ghost["lines"]), (ghost["moved_px"], lines, len(ghost["lines"]))
    here = steep(ghost["lines"], columns, rows, grey)
    assert here, "the part is not in the picture"
    aside = {(du, dv): steep(ghost["lines"], columns, rows, grey, du, dv) for du in (-ASIDE, 0, ASIDE) for dv in (-ASIDE, 0, ASIDE) if du or dv}
    most = max(v for v in aside.values() if v)
    print(f"ghost: the picture changes by {here:.1f} levels across the outlines, by {most:.1f} at most {ASIDE} px aside")
    assert here > 1.15 * most, (here, aside)
    return job


def as_on_the_command_line(program, folder, job):
    """`sheetlight ghost` draws the same part into a picture of the job's scan."""
    own = os.path.join(folder, "jobs", job)
    done = subprocess.run([program, "--json", "ghost", os.path.join(own, "insertion", "found.json"), "--recipe", os.path.join(own, "recipe.toml"),
        "--recording", os.path.join(own, "insertion", "line"), "--station", folder, "--out", os.path.join(folder, "ghost.png")], capture_output=True)
    assert done.returncode == 0, done.stderr.decode()
    drawn = json.loads(done.stdout)
    assert drawn["inside"] > 0.5 and drawn["lines_px"] and os.path.getsize(os.path.join(folder, "ghost.png")) > 1000, drawn["inside"]
