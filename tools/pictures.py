"""In: the built program. Out: the pictures of the guides, of README and of docs/archives.md in docs/images, from a
simulated station.

make pictures runs this after the pages' test and the notebooks, which write the other pictures. The report is drawn by
chromium; where there is none its picture stays as it is, and that is said.
"""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
IMAGES = ROOT / "docs" / "images"
sys.path.insert(0, str(ROOT / "tests" / "web"))

from browser import Browser, levels

# The commands of docs/getting-started.md, as far as pictures come of them.
COMMANDS = """
simulate --out sim --set all --seed 3
station new --station cell3 --robot denso --mount eye-in-hand
calibrate camera sim/intrinsics --station cell3
calibrate hand-eye sim/handeye --station cell3 --poses poses_noisy
calibrate laser-plane sim/laserplane --station cell3
scan sim/scan --station cell3 --out scans/board
find scans/board --recipe {root}/data/recipes/led.toml --station cell3 --out pose.json
"""


def report(page, picture):
    """A picture of a page from its first plot on."""
    if not Browser.there():
        print(f"*** SKIPPED: no chromium and chromedriver here: {picture.name} stays as it is ***")
        return
    with tempfile.TemporaryDirectory() as profile:
        browser = Browser(profile)
        browser.open(page.as_uri())
        browser.run("document.querySelector('svg').scrollIntoView()")
        picture.write_bytes(levels(browser.picture()))
        browser.close()


def main():
    program = Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for line in COMMANDS.format(root=ROOT).split("\n"):
            if line:
                subprocess.run([program, *line.split(), "--quiet"], cwd=folder, check=True)
        board = folder / "scans" / "board"
        overlays = sorted((board / "overlays").glob("*.png"))
        (IMAGES / "guide-found.png").write_bytes(levels((folder / "pose.png").read_bytes()))
        shutil.copyfile(overlays[len(overlays) // 2 - 1], IMAGES / "guide-overlay.png")
        report(folder / "cell3" / "calibration" / "camera.html", IMAGES / "guide-report.png")
        # A year of scans of docs/archives.md.
        drift = [sys.executable, ROOT / "examples" / "archives" / "drift.py", folder / "year", "--program", program]
        subprocess.run(drift, check=True)
        shutil.copyfile(folder / "year" / "drift.png", IMAGES / "archives-drift.png")


main()
