"""In: pictures made here. Out: times of OpenCV's chain, a column centroid, a Steger chain and Sheetlight for the same
pictures, alternating within one run; whether Sheetlight's masks are equal to OpenCV's, pixel for pixel, and whether its
points agree with OpenCV's lens and the plane.
Unit: milliseconds a shot, medians over the rounds; ratios are medians of the rounds' ratios. "ours" has the same result
as OpenCV's chain, a point for the centre of every skeleton pixel. "full" is the chain of a scan, with its settings and
result: each such pixel gets a fitted peak with its standard deviation and all checks that can reject it. "host" is the
same chain on the processor. "by CPU" compares the CPU time of all threads, which is more reliable than wall time on a
busy machine.
"apart" is the largest distance of a point from OpenCV's ray and from the plane, in pixels.

    make bench-peers            (or: python run.py --sheetlight target/release/sheetlight)
"""
import argparse, json, os, subprocess, sys, time
import cv2
import numba
import numpy as np

SIZE, OFFSET = 31, 8
LENS = np.array([-0.118, 0.086, 0.00062, -0.00041, -0.017])
NORMAL, DISTANCE = np.array([0.0, 0.8, 0.6]), 90.0
# Largest allowed distance of points from OpenCV's, px.
APART = 1e-3


def pictures(width, height, count, scene):
    """Pictures of a curved Gaussian stripe with shot noise, read noise and a few reflections."""
    out = []
    x = np.arange(width)
    y = np.arange(height)[:, None]
    for seed in range(count):
        rng = np.random.default_rng(seed)
        sigma = 6.0 if scene == "thick" else 2.5
        centre = height * (0.5 + 0.2 * np.sin(5 * x / width + seed)) + np.where(x > 0.6 * width, 0.1 * height, 0)
        v = 170 * np.exp(-0.5 * ((y - centre) / sigma) ** 2)
        for _ in range(60 if scene == "reflections" else 3):
            bx, by, r = rng.integers(width), rng.integers(height), rng.uniform(2, 10)
            v += 220 * np.exp(-0.5 * ((x - bx) ** 2 + (y - by) ** 2) / r**2) if width * height < 2e6 else 0
            if width * height >= 2e6:
                x0, x1, y0, y1 = max(bx - 40, 0), bx + 40, max(by - 40, 0), by + 40
                v[y0:y1, x0:x1] += 220 * np.exp(
                    -0.5 * ((x[x0:x1] - bx) ** 2 + (y[y0:y1] - by) ** 2) / r**2)
        noise = 7.0 if scene == "noise" else 2.0
        v += 10 + (20 if scene == "noise" else 0)
        v += rng.standard_normal(v.shape) * np.sqrt(noise**2 + 0.05 * v)
        out.append(np.clip(np.rint(v), 0, 255).astype(np.uint8))
    return out


def recorded(folder):
    """At most 32 laser pictures of a recording, spread over it."""
    names = sorted(n for n in os.listdir(folder) if n.startswith("laser") and n.endswith(".png"))
    names = names[:: max(1, len(names) // 32)][:32]
    return [cv2.imread(os.path.join(folder, n), cv2.IMREAD_GRAYSCALE) for n in names]


def camera(width, height):
    return np.array([[0.96 * width, 0, width / 2], [0, 0.96 * width, height / 2], [0, 0, 1.0]])


def plane(rays):
    """Intersects rays with a fixed laser plane; points in mm."""
    return rays * (DISTANCE / (rays @ NORMAL))[:, None]


def opencv(image, k):
    lit = cv2.adaptiveThreshold(image, 255, cv2.ADAPTIVE_THRESH_MEAN_C, cv2.THRESH_BINARY, SIZE, -OFFSET)
    thin = cv2.ximgproc.thinning(lit, thinningType=cv2.ximgproc.THINNING_ZHANGSUEN)
    px = cv2.findNonZero(thin)
    rays = cv2.undistortPoints(px.astype(np.float32), k, LENS).reshape(-1, 2)
    points = plane(np.column_stack([rays, np.ones(len(rays))]))
    return lit, thin, points


# Thinning propagates by one pixel per sub-iteration: a tile with a margin `AROUND` gives the pixels of the whole picture.
TILE, AROUND = 256, 32


def opencv_tiles(image, k):
    """OpenCV's chain with thinning only in tiles of 256 pixels that contain light: faster than its usual use."""
    lit = cv2.adaptiveThreshold(image, 255, cv2.ADAPTIVE_THRESH_MEAN_C, cv2.THRESH_BINARY, SIZE, -OFFSET)
    thin = np.zeros_like(lit)
    for y in range(0, lit.shape[0], TILE):
        for x in range(0, lit.shape[1], TILE):
            if cv2.hasNonZero(lit[y:y + TILE, x:x + TILE]):
                top, left = max(y - AROUND, 0), max(x - AROUND, 0)
                part = lit[top:y + TILE + AROUND, left:x + TILE + AROUND]
                part = cv2.ximgproc.thinning(part, thinningType=cv2.ximgproc.THINNING_ZHANGSUEN)
                to = thin[y:y + TILE, x:x + TILE]
                to[:] = part[y - top:y - top + to.shape[0], x - left:x - left + to.shape[1]]
    px = cv2.findNonZero(thin)
    rays = cv2.undistortPoints(px.astype(np.float32), k, LENS).reshape(-1, 2)
    return lit, thin, plane(np.column_stack([rays, np.ones(len(rays))]))


def threshold_alone(image):
    return cv2.adaptiveThreshold(image, 255, cv2.ADAPTIVE_THRESH_MEAN_C, cv2.THRESH_BINARY, SIZE, -OFFSET)


@numba.njit(cache=True)
def centroid(image, least):
    """Centre of the light around the brightest row of each column; 0 where nothing is bright.

    It goes row by row and without branches, so that numba makes vector instructions of it. It uses one thread: more
    threads take more CPU time here."""
    height, width = image.shape
    best = np.zeros(width, np.uint8)
    at = np.zeros(width, np.uint16)
    for y in range(height):
        row, here = image[y], np.uint16(y)
        for x in range(width):
            at[x] = here if row[x] > best[x] else at[x]
            best[x] = max(row[x], best[x])
    out = np.zeros(width)
    for x in range(width):
        if best[x] >= least:
            light, moment = 0, 0
            for y in range(max(int(at[x]) - 8, 0), min(int(at[x]) + 9, height)):
                v = int(image[y, x])
                light += v
                moment += v * y
            out[x] = moment / light
    return out


@numba.njit(cache=True, parallel=True)
def ridge(gx, gy, gxx, gxy, gyy, least):
    """Steger 1998: pixels that contain the zero of the derivative across the stripe."""
    height, width = gx.shape
    out = np.zeros((height, width), np.uint8)
    for y in numba.prange(1, height - 1):
        for x in range(1, width - 1):
            a, b, c = gxx[y, x], gxy[y, x], gyy[y, x]
            d = 0.5 * (a - c)
            q = np.sqrt(d * d + b * b)
            low = 0.5 * (a + c) - q
            if low > -least:
                continue
            nx, ny = b, low - a
            l = np.sqrt(nx * nx + ny * ny)
            if l == 0:
                continue
            nx, ny = nx / l, ny / l
            t = -(gx[y, x] * nx + gy[y, x] * ny) / low
            if abs(t * nx) <= 0.5 and abs(t * ny) <= 0.5:
                out[y, x] = 1
    return out


def steger(image, sigma=2.5):
    f = cv2.GaussianBlur(image.astype(np.float32), (0, 0), sigma)
    gx, gy = cv2.Sobel(f, cv2.CV_32F, 1, 0, scale=1 / 8), cv2.Sobel(f, cv2.CV_32F, 0, 1, scale=1 / 8)
    gxx, gyy = cv2.Sobel(f, cv2.CV_32F, 2, 0, scale=1 / 4), cv2.Sobel(f, cv2.CV_32F, 0, 2, scale=1 / 4)
    gxy = cv2.Sobel(f, cv2.CV_32F, 1, 1, scale=1 / 4)
    return cv2.findNonZero(ridge(gx, gy, gxx, gxy, gyy, 4.0))


@numba.njit(cache=True)
def plain_read(words):
    s = np.uint64(0)
    for w in words:
        s += w
    return s


class Sheetlight:
    def __init__(self, program, images, batch, k, width_px):
        height, width = images[0].shape
        self.shape = (height, width)
        self.pipe = subprocess.Popen([program, "bench", "--peer-pipe"], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        setup = dict(width=width, height=height, count=len(images), shots_per_batch=batch, size=SIZE, offset=OFFSET,
                     pinhole=[k[0, 0], k[1, 1], k[0, 2], k[1, 2], 0.0], distortion=list(LENS),
                     normal=list(NORMAL), offset_mm=DISTANCE,
                     # None: Sheetlight learns the width.
                     width_px=width_px)
        self.pipe.stdin.write(json.dumps(setup).encode() + b"\n")
        for image in images:
            self.pipe.stdin.write(image.tobytes())
        self.pipe.stdin.flush()
        answer = json.loads(self.pipe.stdout.readline())
        self.adapter, self.width_px = answer["ready"], answer["width_px"]

    def ask(self, command):
        self.pipe.stdin.write(json.dumps(command).encode() + b"\n")
        self.pipe.stdin.flush()

    def run(self, times, command="run"):
        self.ask({command: times})
        return json.loads(self.pipe.stdout.readline())

    def points(self, i):
        """x, y, X, Y, Z of every skeleton pixel, sorted by row from the top, then by column."""
        self.ask({"points": i})
        n = json.loads(self.pipe.stdout.readline())["points"]
        rows = np.frombuffer(self.pipe.stdout.read(20 * n), "<f4").reshape(n, 5).astype(float)
        return rows[np.lexsort((rows[:, 0], rows[:, 1]))]

    def masks(self, i):
        self.ask({"masks": i})
        n = self.shape[0] * self.shape[1]
        read = lambda: np.frombuffer(self.pipe.stdout.read(n), np.uint8).reshape(self.shape)
        return read(), read()

    def close(self):
        self.ask("quit")
        self.pipe.wait()


def clock(f, times=1):
    wall, cpu = time.perf_counter(), time.process_time()
    for _ in range(times):
        f()
    return (time.perf_counter() - wall) * 1e3 / times, (time.process_time() - cpu) * 1e3 / times


def points_apart(thin, ours, k):
    """Largest distance of Sheetlight's points from OpenCV's viewing rays of the same pixels and from the plane, in pixels
    at their depth; infinite if the pixels differ."""
    px = cv2.findNonZero(thin).reshape(-1, 2)
    px = px[np.lexsort((px[:, 0], px[:, 1]))]
    if len(px) != len(ours) or not np.array_equal(px, ours[:, :2]):
        return float("inf")
    # Iterates to convergence: the default of five steps leaves a larger error than `APART`.
    end = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-12)
    rays = cv2.undistortPointsIter(px.astype(np.float64).reshape(-1, 1, 2), k, LENS, np.eye(3), np.eye(3), end).reshape(-1, 2)
    points = ours[:, 2:]
    from_ray = np.linalg.norm(points[:, :2] / points[:, 2:] - rays, axis=1)
    from_plane = np.abs(points @ NORMAL - DISTANCE) / points[:, 2]
    off = np.maximum(from_ray, from_plane)
    return float("inf") if np.isnan(off).any() else float(off.max() * k[0, 0])


def compare(program, width, height, scene, rounds, images=None):
    count = 32 if width * height < 5e5 else 8 if width * height < 5e6 else 2
    batch = 32 if width * height < 5e5 else 8 if width * height < 5e6 else 1
    # The width of a rendered stripe is known. That of a recording is learned, as in a scan.
    width_px = None if images else 6.0 if scene == "thick" else 2.5
    images = images or pictures(width, height, count, scene)
    count = len(images)
    batch = min(batch, count)
    k = camera(width, height)
    ours = Sheetlight(program, images, batch, k, width_px)
    wrong_lit = wrong_thin = apart = tiles_differ = 0
    for i, image in enumerate(images[:2]):
        lit, thin, _ = opencv(image, k)
        tiles_differ = max(tiles_differ, int(np.count_nonzero(thin != opencv_tiles(image, k)[1])))
        our_lit, our_thin = ours.masks(i)
        wrong_lit += int(np.count_nonzero(lit != our_lit))
        wrong_thin += int(np.count_nonzero(thin != our_thin))
        apart = max(apart, points_apart(thin, ours.points(i), k))
    centroid(images[0], 40), steger(images[0]), plain_read(images[0].view(np.uint64).ravel())
    names = ["opencv", "tiles", "threshold", "centroid", "sheetlight", "full", "host", "host_singly"]
    times = {n: [] for n in names + [n + "_cpu" for n in names] + ["steger", "read"]}
    turns = max(1, int(100 / (count * (width * height / 1e6) + 1)))
    for r in range(rounds):
        image = images[r % count]
        words = image.view(np.uint64).ravel()
        peers = [("opencv", lambda: opencv(image, k), 1), ("tiles", lambda: opencv_tiles(image, k), 1),
                 # All pictures in turn: a single one would be in the cache from the second run on.
                 ("threshold", lambda: [threshold_alone(i) for i in images], count),
                 ("centroid", lambda: [centroid(i, 40) for i in images], count)]
        for name, peer, shots in peers:
            wall, cpu = clock(peer)
            times[name].append(wall / shots)
            times[name + "_cpu"].append(cpu / shots)
        for name, command in [("sheetlight", "run"), ("full", "run_full"), ("host", "run_host"), ("host_singly", "run_host_singly")]:
            answer = ours.run(turns, command)
            times[name].append(answer["wall_s"] * 1e3 / answer["shots"])
            times[name + "_cpu"].append(answer["cpu_s"] * 1e3 / answer["shots"])
        times["steger"].append(clock(lambda: steger(image))[0])
        times["read"].append(clock(lambda: plain_read(words), 10)[1])
    ours.close()
    median = {n: float(np.median(t)) for n, t in times.items()}
    ratio = lambda a, b: float(np.median(np.array(times[a]) / np.array(times[b])))
    return dict(
        size=f"{width}x{height}", scene=scene, batch=batch, rounds=rounds, ms=median, adapter=ours.adapter,
        stripe_width_px=ours.width_px,
        opencv_over_ours=ratio("opencv", "sheetlight"), opencv_cpu_over_our_cpu=ratio("opencv_cpu", "sheetlight_cpu"),
        opencv_over_full=ratio("opencv", "full"), opencv_cpu_over_full_cpu=ratio("opencv_cpu", "full_cpu"),
        tiles_over_host=ratio("tiles", "host_singly"), tiles_cpu_over_host_cpu=ratio("tiles_cpu", "host_cpu"),
        host_over_threshold=ratio("host_singly", "threshold"), host_cpu_over_centroid_cpu=ratio("host_cpu", "centroid_cpu"),
        host_cpu_over_plain_read=ratio("host_cpu", "read"), cv2_threads=cv2.getNumThreads(),
        tiles_pixels_apart=tiles_differ,
        steger_over_ours=ratio("steger", "sheetlight"),
        centroid_over_ours=ratio("centroid", "sheetlight"), cpu_over_plain_read=ratio("sheetlight_cpu", "read"),
        lit_pixels_apart=wrong_lit, skeleton_pixels_apart=wrong_thin,
        points_apart_px=apart)


def main():
    here = os.path.dirname(os.path.abspath(__file__))
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--sheetlight", default=os.path.join(here, "../../target/release/sheetlight"))
    p.add_argument("--size", action="append", help="WIDTHxHEIGHT, may be repeated")
    p.add_argument("--scene", action="append", choices=["stripe", "thick", "noise", "reflections"])
    p.add_argument("--recording", action="append", default=[], help="also the laser pictures of this folder")
    p.add_argument("--rounds", type=int, default=7)
    p.add_argument("--save", help="file for the figures as JSON")
    args = p.parse_args()
    rows = []
    print(f"{'size':10} {'scene':12} {'OpenCV':>9} {'Steger':>9} {'centroid':>9} {'ours':>9} {'our CPU':>9} {'full':>9} {'read':>7}"
          f" {'OpenCV/ours':>12} {'by CPU':>8} {'/full':>8} {'by CPU':>8} {'CPU/read':>9}  masks      apart")
    work = []
    for size in args.size or ["640x480", "1280x960", "4096x3072", "5120x5120"]:
        width, height = map(int, size.split("x"))
        work += [(width, height, scene, None) for scene in args.scene or ["stripe"]]
    for folder in args.recording:
        images = recorded(folder)
        height, width = images[0].shape
        work.append((width, height, os.path.basename(os.path.normpath(folder)), images))
    for width, height, scene, images in work:
        size = f"{width}x{height}"
        r = compare(args.sheetlight, width, height, scene, args.rounds, images)
        rows.append(r)
        m = r["ms"]
        same = "identical" if r["lit_pixels_apart"] + r["skeleton_pixels_apart"] == 0 else \
            f"DIFFER in {r['lit_pixels_apart']} lit, {r['skeleton_pixels_apart']} skeleton pixels"
        print(f"{size:10} {scene:12} {m['opencv']:9.2f} {m['steger']:9.2f} {m['centroid']:9.2f}"
              f" {m['sheetlight']:9.3f} {m['sheetlight_cpu']:9.3f} {m['full']:9.3f} {m['read']:7.3f}"
              f" {r['opencv_over_ours']:11.1f}x {r['opencv_cpu_over_our_cpu']:7.1f}x {r['opencv_over_full']:7.1f}x"
              f" {r['opencv_cpu_over_full_cpu']:7.1f}x {r['cpu_over_plain_read']:8.1f}x  {same}  {r['points_apart_px']:.1e} px", flush=True)
        print(f"{'':10} on the processor, settings and result of a scan: batch {m['host']:.3f} ms (CPU {m['host_cpu']:.3f}), one at a time"
              f" {m['host_singly']:.3f} (CPU {m['host_singly_cpu']:.3f}); OpenCV on lit tiles {m['tiles']:.2f} (CPU {m['tiles_cpu']:.2f}), its threshold"
              f" alone {m['threshold']:.3f} ({r['cv2_threads']} threads); centroid CPU {m['centroid_cpu']:.3f}\n{'':10} by CPU: OpenCV on lit tiles / ours"
              f" {r['tiles_cpu_over_host_cpu']:.1f}x, ours / centroid {r['host_cpu_over_centroid_cpu']:.2f}, ours / read"
              f" {r['host_cpu_over_plain_read']:.1f}; wall: ours one at a time / threshold {r['host_over_threshold']:.2f}", flush=True)
    if args.save:
        with open(args.save, "w") as f:
            json.dump(rows, f, indent=1)
    sys.exit(any(r["lit_pixels_apart"] + r["skeleton_pixels_apart"] + r["tiles_pixels_apart"] or r["points_apart_px"] > APART for r in rows))


if __name__ == "__main__":
    main()
