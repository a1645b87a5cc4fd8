"""In: the screen over a simulated cell whose job has found a part, the browser that shows it. Out: failure where the part's outlines lie
beside what the camera's picture shows, or the page or the command line draws something else.
Frame and unit: px, grey levels."""

import json
import os
import struct
import subprocess

import waits

# Outlines that are moved aside by so much lie on fewer edges, px.
ASIDE = 6


def picture(s):
    """The camera's newest picture: number, columns, rows, levels."""
    status, _, b = s.ask("GET", "/api/v1/camera/newest?after=0")
    assert status == 200, status
    number, columns, rows, peaks = struct.unpack("<4I", b[:16])
    return number, columns, rows, b[20 + 12 * peaks:]


def steep(lines, columns, rows, grey, du=0, dv=0):
    """How much the picture changes across the lines, on average; None where too little of them lies in it."""
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
    """Before the arm goes above the part: the page draws its outlines over the picture, on the edges that the picture shows."""
    job = s.json("GET", "/motion")["asked"]["job"]
    b.until("the part over the picture", "return Number(document.querySelector('canvas.live')?.dataset.ghost) > 0")

    def both():
        """The same picture at the page and here, and the part in it: newer pictures come at any time, poses a moment after them."""
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
    """`sheetlight ghost` draws the same part into a picture of the job's own scan."""
    own = os.path.join(folder, "jobs", job)
    done = subprocess.run([program, "--json", "ghost", os.path.join(own, "insertion", "found.json"), "--recipe", os.path.join(own, "recipe.toml"),
        "--recording", os.path.join(own, "insertion", "line"), "--station", folder, "--out", os.path.join(folder, "ghost.png")], capture_output=True)
    assert done.returncode == 0, done.stderr.decode()
    drawn = json.loads(done.stdout)
    assert drawn["inside"] > 0.5 and drawn["lines_px"] and os.path.getsize(os.path.join(folder, "ghost.png")) > 1000, drawn["inside"]
