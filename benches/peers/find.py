"""In: the pictures that benches/find.rs leaves in target/find-bench, and Criterion's times of Sheetlight on them.
Out: OpenCV's times for the same search over all rotations: the detector linemod; matchTemplate on the pyramid level
where Sheetlight's search starts, with the same rotations; matchTemplate at full size (a few rotations, extrapolated to all).
Unit: milliseconds, best of several runs, with all of OpenCV's threads.

    make bench-peers            (or: python find.py --cargo cargo)
"""
import argparse, glob, json, math, os, subprocess, time
import cv2
import numpy as np

ROOT = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
# Cargo's target folder.
TARGET = os.path.join(ROOT, os.environ.get("CARGO_TARGET_DIR", "target"))
NAMES = ["picture 1280x1024", "height map 2000x2000"]


def best(work, runs):
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        result = work()
        times.append(1000.0 * (time.perf_counter() - start))
    return min(times), result


def turned(template, mask, angle_deg, fill):
    """The template and its mask, rotated about the centre on a canvas that is large enough for every rotation."""
    h, w = template.shape
    side = int(math.ceil(math.hypot(w, h)))
    m = cv2.getRotationMatrix2D(((w - 1) / 2, (h - 1) / 2), -angle_deg, 1.0)
    m[:, 2] += (side - w) / 2, (side - h) / 2
    picture = cv2.warpAffine(template, m, (side, side), borderValue=fill)
    return picture, cv2.warpAffine(mask, m, (side, side), flags=cv2.INTER_NEAREST)


def cropped(picture, mask):
    x, y, w, h = cv2.boundingRect(mask)
    return picture[y : y + h, x : x + w], mask[y : y + h, x : x + w], (x, y)


def angles(count):
    return [360.0 * i / count for i in range(count)]


def match_templates(scene, template, mask, turns, fill):
    found = (-2.0, 0.0)
    for a in turns:
        t, m, _ = cropped(*turned(template, mask, a, fill))
        score = cv2.matchTemplate(scene, t, cv2.TM_CCOEFF_NORMED)
        found = max(found, (float(score.max()), a))
    return found


def linemod(scene, template, mask, fill, step):
    detector = cv2.linemod.getDefaultLINE()
    added = 0
    for a in angles(round(360 / step)):
        t, m, _ = cropped(*turned(template, mask, a, fill))
        t, m = (cv2.copyMakeBorder(i, 16, 16, 16, 16, cv2.BORDER_CONSTANT, value=f) for i, f in ((t, fill), (m, 0)))
        ident, _ = detector.addTemplate([cv2.cvtColor(t, cv2.COLOR_GRAY2BGR)], "part", m)
        added += int(ident >= 0)
    # linemod needs sides that its strides (5, and 8 at half size) divide. The rows of both sizes must be a multiple of
    # 16 px long, or its aligned stores crash (opencv/opencv_contrib#4192).
    h, w = -scene.shape[0] % 80, -scene.shape[1] % 160
    colour = cv2.cvtColor(cv2.copyMakeBorder(scene, 0, h, 0, w, cv2.BORDER_REPLICATE), cv2.COLOR_GRAY2BGR)
    ms, out = best(lambda: detector.match([colour], 75.0, ["part"]), 5)
    return ms, added, len(out[0]), max((m.similarity for m in out[0]), default=0.0)


def ours(cargo):
    subprocess.run([cargo, "bench", "--locked", "--bench", "find"], cwd=ROOT, check=True)
    times = {}
    for path in glob.glob(os.path.join(TARGET, "criterion/find/*/new/sample.json")):
        with open(path) as f, open(os.path.join(os.path.dirname(path), "benchmark.json")) as g:
            sample = json.load(f)
            # Uses the best run, as for OpenCV.
            each = [t / n for t, n in zip(sample["times"], sample["iters"])]
            times[json.load(g)["function_id"]] = min(each) / 1e6
    return times


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--cargo", default="cargo")
    parser.add_argument("--times", help="JSON of earlier times of ours instead of running the bench")
    parser.add_argument("--out", help="file for the figures")
    args = parser.parse_args()
    times = json.load(open(args.times)) if args.times else ours(args.cargo)
    lines = [f"OpenCV {cv2.__version__}, {cv2.getNumThreads()} threads; ms for one full search"]
    for name in NAMES:
        folder = os.path.join(ROOT, "target/find-bench")
        scene, template = (cv2.imread(os.path.join(folder, f"{name} {k}.png"), 0) for k in ("scene", "template"))
        said = json.load(open(os.path.join(folder, f"{name}.json")))
        fill = int(np.median(template[:4]))
        mask = cv2.morphologyEx((template > (fill + int(template.max())) // 2).astype(np.uint8) * 255, cv2.MORPH_CLOSE, np.ones((9, 9)))
        mask = cv2.dilate(mask, np.ones((7, 7)))
        for what in sorted(k for k in times if k.startswith(name)):
            lines.append(f"{what:52} {times[what]:10.1f}")
        # The rotations of Sheetlight's coarse search: steps of 1.6 px at the model's rim, on the level where it starts.
        level = said["levels"] - 1
        count = math.ceil(2 * math.pi * max(said["radius"] / 2**level, 4.0) / 1.6)
        small = [cv2.resize(i, None, fx=0.5**level, fy=0.5**level, interpolation=cv2.INTER_AREA) for i in (scene, template, mask)]
        ms, found = best(lambda: match_templates(*small, angles(count), fill), 3)
        lines.append(f"{f'  matchTemplate, 1/{2**level} size, {count} turns':52} {ms:10.1f}   score {found[0]:.2f} at {found[1]:.1f} degrees")
        few = angles(count)[:: max(1, count // 4)]
        ms, _ = best(lambda: match_templates(scene, template, mask, few, fill), 1)
        fine = math.ceil(2 * math.pi * said["radius"] / 1.6)
        lines.append(f"{f'  matchTemplate, full size, {fine} turns (from {len(few)})':52} {ms / len(few) * fine:10.1f}")
        ms, added, matches, top = linemod(scene, template, mask, fill, 5.0)
        lines.append(f"{f'  linemod, {added} templates 5 degrees apart':52} {ms:10.1f}   {matches} matches, best {top:.1f} %; no sub-pixel pose")
    text = "\n".join(lines) + "\n"
    print(text, end="")
    if args.out:
        open(args.out, "w").write(text)


if __name__ == "__main__":
    main()
