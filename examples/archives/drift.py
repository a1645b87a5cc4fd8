"""Drift of a station over a year of simulated scans: tables of a batch, asked with DuckDB, as a plot.

    python examples/archives/drift.py FOLDER [--program sheetlight] [--scans 52]

A part stays where it is. The robot reports places that drift by 0.15 mm over the year, and a summer of 0.1 mm. The
batch finds the part in every scan; what moves is the station. The pictures are the same on every day.
It needs duckdb, matplotlib, and the program.
"""

from __future__ import annotations

import argparse
import datetime
import json
import math
import random
import shutil
import subprocess
from pathlib import Path

QUERY = """
SELECT regexp_extract(recording, '(\\d{4}-\\d{2}-\\d{2})', 1)::DATE AS day,
       x_mm - first(x_mm) OVER (ORDER BY recording) AS drift_mm,
       sqrt((r11 * sigma_x_mm)**2 + (r12 * sigma_y_mm)**2 + (r13 * sigma_z_mm)**2) AS sigma_mm
FROM read_parquet('{tables}/matches.parquet') AS matches
JOIN read_parquet('{tables}/recordings.parquet') AS recordings USING (recording)
WHERE passed
ORDER BY day
"""


#: How far a day's places are off, 1 sigma.
NOISE_MM = 0.01


def drift_mm(day: int) -> float:
    """What the robot's places drift by along x until a day of the year."""
    return 0.15 * day / 365 + 0.05 * (1 - math.cos(2 * math.pi * day / 365))


def simulate(folder: Path, program: str, scans: int) -> None:
    """An archive with a recording on each of some days."""
    rig = Path(__file__).resolve().parents[2] / "data/rigs/paper.toml"
    words = ["simulate", "--out", folder / "simulated", "--rig", rig, "--seed", "3", "--width", "320", "--quiet"]
    subprocess.run([program, *map(str, words)], check=True, capture_output=True)
    for k in range(scans):
        day = round(365 * k / scans)
        date = datetime.date(2025, 1, 1) + datetime.timedelta(days=day)
        recording = folder / "archive" / str(date) / "scan"
        shutil.copytree(folder / "simulated/scan", recording)
        # The robot does not come to the same place twice.
        off = random.Random(k).gauss(0, NOISE_MM)
        poses = json.loads((recording / "poses.json").read_text())
        for pose in poses["poses"]:
            pose["matrix"][3] += drift_mm(day) + off
        (recording / "poses.json").write_text(json.dumps(poses))


def batch(folder: Path, program: str) -> Path:
    """Scans the archive and finds the part; the folder of the tables."""
    made, tables = folder / "simulated", folder / "batch"
    manifest = ["batch", "manifest", folder / "archive", "--out", folder / "archive/manifest.txt", "--quiet"]
    subprocess.run([program, *map(str, manifest)], check=True)
    words = ["batch", folder / "archive/manifest.txt", "--station", made / "station", "--recipe", made / "notched.toml"]
    words += ["--out", tables, "--quiet"]
    subprocess.run([program, *map(str, words)], check=True, stdout=subprocess.DEVNULL)
    return tables


def plot(rows: list[tuple[datetime.date, float, float]], picture: Path) -> None:
    """Drift over the year with what each scan states, and what was simulated."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    days, drifts, sigmas = zip(*rows)
    figure, axes = pyplot.subplots(figsize=(8, 3.2), layout="constrained")
    year = [datetime.date(2025, 1, 1) + datetime.timedelta(days=d) for d in range(366)]
    axes.plot(year, [drift_mm(d) for d in range(366)], color="0.6", label="simulated")
    axes.errorbar(days, drifts, sigmas, fmt="o", markersize=3, linewidth=0.8, label="found, 1 sigma as stated")
    axes.set(ylabel="x of the part, mm from the first scan")
    axes.legend()
    figure.savefig(picture, dpi=80)


def main() -> None:
    """Simulates, scans, asks, plots; the last line printed is JSON."""
    import duckdb

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--program", default="sheetlight")
    parser.add_argument("--scans", type=int, default=52)
    given = parser.parse_args()
    simulate(given.folder, given.program, given.scans)
    tables = batch(given.folder, given.program)
    rows = duckdb.sql(QUERY.replace("{tables}", str(tables))).fetchall()
    plot(rows, given.folder / "drift.png")
    start = datetime.date(2025, 1, 1)
    errors = [drift - drift_mm((day - start).days) for day, drift, _ in rows]
    rms = math.sqrt(sum(e * e for e in errors) / len(errors))
    print(json.dumps({"scans": len(rows), "drift_mm": rows[-1][1], "rms_mm": rms}))


if __name__ == "__main__":
    main()
