//! In: a cloud and a choice of grid. Out: where the cells lie and how heights become whole numbers.
//! Frame and unit: points in the base frame, mm; the grid's frame is the scan's best plane unless given.

use crate::fault::{Fault, Result};
use crate::geometry::{Base, Grid, Mat3, Plane, Rigid, Vec3, fit_plane};
use crate::scan::PointSource;
use crate::stages::grid::Z_MOST;
use rand::{Rng, SeedableRng};

/// How a cloud becomes a height map.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GridOptions {
    /// Edge of a cell, mm, 0.0001..=500; by default about 1.5 points a cell, rounded to half a unit of its first
    /// digit.
    #[serde(rename = "cell_mm")]
    pub cell: Option<f64>,
    /// Pose of the grid; by default the scan's best plane, with x along the base's x.
    pub base_from_grid: Option<Rigid<Base, Grid>>,
    /// Number of cells [x, y]; by default enough to hold the points.
    pub cells: Option<[u32; 2]>,
    /// Points of one cell that are farther apart than this belong to two surfaces, mm, 0.0001..=100. By default the
    /// rise of a slope of 31 degrees over a cell, and at least six of the points' own standard deviations.
    #[serde(rename = "layer_mm")]
    pub layer: Option<f64>,
    /// Points of lower quality are excluded, 0..=1.
    pub min_quality: f32,
    /// A direction in the base frame that the grid's "up" must agree with: towards the camera.
    pub up: Vec3,
}

impl Default for GridOptions {
    fn default() -> Self {
        GridOptions { cell: None, base_from_grid: None, cells: None, layer: None, min_quality: 0.0, up: Vec3::z() }
    }
}

/// Most cells a height map may have: 64 M cells take 4 GB while they are filled.
pub const MOST_CELLS: u64 = 1 << 26;

/// Most cells of a map whose cell size nobody chose, however long the scan: 240 MB while they are filled.
pub const FEW_CELLS: u64 = 1 << 22;

/// A steeper rise counts as a step between two surfaces, mm per mm.
pub const SLOPE: f64 = 0.6;

impl GridOptions {
    /// Refuses options outside their ranges.
    pub fn check(&self) -> Result<()> {
        let bad = |name: &str, value: f64, range: &str| {
            Err(Fault::usage(format!("{name} is {value}, allowed {range}")).next("correct the grid options"))
        };
        match self.cell {
            Some(c) if !(1e-4..=500.0).contains(&c) => return bad("cell_mm", c, "0.0001..=500"),
            _ => {}
        }
        match self.layer {
            Some(l) if !(1e-4..=100.0).contains(&l) => return bad("layer_mm", l, "0.0001..=100"),
            _ => {}
        }
        if !(0.0..=1.0).contains(&self.min_quality) {
            return bad("min_quality", f64::from(self.min_quality), "0..=1");
        }
        if self.up.norm() < 1e-6 {
            return bad("length of up", self.up.norm(), "more than 1e-6");
        }
        Ok(())
    }
}

/// Where the cells lie and how heights become integers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridSpec {
    /// Pose of the grid in the cloud's frame, mm; its origin is the outer corner of cell (0, 0).
    pub base_from_grid: Rigid<Base, Grid>,
    /// Columns: cells along the grid's x.
    pub width: u32,
    /// Rows: cells along the grid's y.
    pub height: u32,
    /// Edge of a cell, mm.
    pub cell: f64,
    /// Height of one integer step, mm; 16-bit heights times 65,535 points stay within 32 bits.
    pub z_step: f32,
    /// A cell that spans more integer steps than this holds two surfaces.
    pub layer_steps: i32,
    /// Largest intensity of the points, grey levels.
    pub most_intensity: f32,
}

/// Chooses frame, extent, cell and height step from the points, as far as the options do not set them.
pub fn choose(source: &(impl PointSource + ?Sized), options: &GridOptions) -> Result<GridSpec> {
    let sample = sample(source, options.min_quality)?;
    if sample.points.len() < 3 {
        return Err(Fault::refused(format!("the cloud has {} points, 3 are needed for a height map", sample.total))
            .cause("no laser was found in the shots, or min_quality is too high")
            .next("look at the overlays of a few shots"));
    }
    let base_from_grid = match options.base_from_grid {
        Some(frame) => frame,
        None => best_frame(&sample, &options.up)?,
    };
    let grid_from_base = base_from_grid.inverse();
    let local: Vec<Vec3> = sample.points.iter().map(|p| grid_from_base.point(p)).collect();
    // All points lie within the sample's extent, except for a thin margin that a sample can miss.
    let [(x0, x1), (y0, y1), (z0, z1)] = extents(&local);
    let area = ((x1 - x0) * (y1 - y0)).max(1e-12);
    let cell = options.cell.unwrap_or_else(|| {
        let wished = (1.5 * area / sample.total as f64).sqrt();
        let least = (area / FEW_CELLS as f64).sqrt();
        let unit = |x: f64| 0.5 * 10f64.powi(x.log10().floor() as i32);
        let round = |x: f64| (x / unit(x)).round() * unit(x);
        let up = |x: f64| (x / unit(x)).ceil() * unit(x);
        round(wished).max(up(least)).clamp(1e-4, 500.0)
    });
    let layer = options.layer.unwrap_or_else(|| (SLOPE * cell).max(6.0 * sample.sigma));
    let shift = if options.base_from_grid.is_some() {
        Vec3::zeros()
    } else {
        let [x, y] = [(0, x0), (1, y0)].map(|(axis, first)| beside_the_points(&local, axis, first, cell));
        Vec3::new(x0 - x, y0 - y, 0.0)
    };
    let base_from_grid = Rigid::new(base_from_grid.rotation, base_from_grid.point(&shift));
    let [width, height] = options.cells.map_or_else(
        || [(x1 - shift.x) / cell, (y1 - shift.y) / cell].map(|n| n.ceil().max(1.0)),
        |c| c.map(f64::from),
    );
    if width * height > MOST_CELLS as f64 {
        return Err(Fault::refused(format!(
            "the height map would have {width:.0} x {height:.0} cells of {cell} mm, limit {MOST_CELLS}"
        ))
        .cause("the cell is small against the scan, or a few stray points widen it")
        .next("choose a larger cell_mm, or give base_from_grid and cells"));
    }
    let reach = z0.abs().max(z1.abs()) * 1.05 + 0.01 * (x1 - x0).max(y1 - y0);
    let z_step = (reach / f64::from(Z_MOST)) as f32;
    let layer_steps = (layer / f64::from(z_step)).round().max(1.0) as i32;
    Ok(GridSpec {
        base_from_grid,
        width: width as u32,
        height: height as u32,
        cell,
        z_step,
        layer_steps,
        most_intensity: sample.most_intensity,
    })
}

/// Distance of the first cell's edge from the first point along an axis, mm, 0 for most scans. Points on a raster as
/// fine as the cells would lie on edges between these, where rounding puts two of them into one cell and none into the
/// next: the edges go through the middle of the widest gap between the points' places in their cells instead.
fn beside_the_points(points: &[Vec3], axis: usize, first: f64, cell: f64) -> f64 {
    const BINS: usize = 64;
    /// A narrower gap, in bins, tells of no raster.
    const LEAST: usize = BINS / 8;
    let mut taken = [false; BINS];
    // Places are counted from half a bin before the first point, so that rounding does not part those that are equal.
    for p in points {
        let place = ((p[axis] - first) / cell + 0.5 / BINS as f64).rem_euclid(1.0);
        taken[(place * BINS as f64) as usize % BINS] = true;
    }
    let free = |start: usize| (0..BINS).take_while(|k| !taken[(start + k) % BINS]).count();
    let (start, width) = (0..BINS).map(|start| (start, free(start))).max_by_key(|(_, width)| *width).unwrap_or((0, 0));
    if width < LEAST {
        return 0.0;
    }
    let edge = (start as f64 + 0.5 * width as f64 - 0.5) / BINS as f64;
    cell * (1.0 - edge).rem_euclid(1.0)
}

pub struct Sample {
    points: Vec<Vec3>,
    /// Median of the points' own standard deviations, mm.
    sigma: f64,
    total: u64,
    most_intensity: f32,
}

/// Up to 200,000 points, taken evenly from the source. They include the extreme points of every chunk, so that the
/// extent is that of the whole cloud.
pub fn sample(source: &(impl PointSource + ?Sized), min_quality: f32) -> Result<Sample> {
    const MOST: usize = 200_000;
    let mut sigmas = Vec::new();
    let mut out = Sample { points: Vec::new(), sigma: 0.0, total: 0, most_intensity: 0.0 };
    let mut extremes: [[Option<(f32, Vec3)>; 2]; 3] = Default::default();
    let mut stride = 1u64;
    source.for_each_chunk(&mut |chunk| {
        for p in chunk.iter().filter(|p| p.quality >= min_quality && p.position.is_finite()) {
            let point = p.at();
            out.most_intensity = out.most_intensity.max(p.intensity);
            for (axis, [low, high]) in extremes.iter_mut().enumerate() {
                let value = p.position[axis];
                if low.is_none_or(|(v, _)| value < v) {
                    *low = Some((value, point));
                }
                if high.is_none_or(|(v, _)| value > v) {
                    *high = Some((value, point));
                }
            }
            if out.total.is_multiple_of(stride) {
                if sigmas.len() < MOST {
                    sigmas.push(p.sigma_mm);
                }
                out.points.push(point);
                if out.points.len() >= MOST {
                    let mut i = 0;
                    out.points.retain(|_| {
                        i += 1;
                        i % 2 == 1
                    });
                    stride *= 2;
                }
            }
            out.total += 1;
        }
    })?;
    out.points.extend(extremes.iter().flatten().flatten().map(|(_, p)| *p));
    if !sigmas.is_empty() {
        let middle = sigmas.len() / 2;
        out.sigma = f64::from(*sigmas.select_nth_unstable_by(middle, f32::total_cmp).1);
    }
    Ok(out)
}

/// Extents along x, y, z. Up to 0.02 % of the points on either side may be outliers, which do not widen the grid.
pub fn extents(points: &[Vec3]) -> [(f64, f64); 3] {
    let of = |axis: usize| {
        let mut values: Vec<f64> = points.iter().map(|p| p[axis]).collect();
        let mut at = |i: usize| *values.select_nth_unstable_by(i, f64::total_cmp).1;
        let (last, cut) = (points.len() - 1, points.len() / 5_000);
        [0, cut, last - cut, last].map(&mut at)
    };
    let all = [of(0), of(1), of(2)];
    let largest = all.iter().map(|[_, low, high, _]| high - low).fold(0.0, f64::max);
    // Outliers are points beyond a gap; a dense edge stays complete.
    all.map(|[least, low, high, most]| {
        let margin = 0.01 * (high - low) + 0.005 * largest;
        (least.max(low - margin), most.min(high + margin))
    })
}

/// The scan's best plane: the one with most points near it (seeded consensus over 400 triples), then least squares
/// over its points. x is the base's x projected into the plane, z points `up`. "Near" is six of the points' own
/// standard deviations, and at least a five-hundredth of the scan's size: boards and tables are flat to that.
pub fn best_frame(sample: &Sample, up: &Vec3) -> Result<Rigid<Base, Grid>> {
    let points = &sample.points;
    let size = extents(points).iter().map(|(a, b)| b - a).fold(0.0, f64::max);
    let near = (6.0 * sample.sigma).max(size / 500.0);
    let flat = || {
        Fault::refused("the cloud's points lie on a line, a height map needs a surface")
            .cause("only one shot, or a robot that did not move")
            .next("scan across the part, or give the grid's frame")
    };
    let mut rng = rand_pcg::Pcg64::seed_from_u64(1);
    let step = (points.len() / 5_000).max(1);
    let probe: Vec<Vec3> = points.iter().step_by(step).copied().collect();
    let mut best: Option<(usize, Plane<Base>)> = None;
    for _ in 0..400 {
        let [a, b, c] = std::array::from_fn(|_| probe[rng.random_range(0..probe.len())]);
        let normal = (b - a).cross(&(c - a));
        // A sliver of a triangle does not determine the plane's tilt.
        if normal.norm() < 1e-2 * (b - a).norm() * (c - a).norm() {
            continue;
        }
        let Some(plane) = Plane::<Base>::new(normal, normal.dot(&a)) else { continue };
        let count = probe.iter().filter(|p| plane.distance(p).abs() < near).count();
        if best.is_none_or(|(n, _)| count > n) {
            best = Some((count, plane));
        }
    }
    let (_, mut plane) = best.ok_or_else(flat)?;
    for _ in 0..3 {
        let on: Vec<Vec3> = points.iter().filter(|p| plane.distance(p).abs() < near).copied().collect();
        plane = fit_plane(&on).ok_or_else(flat)?.0;
    }
    if plane.normal.dot(up) < 0.0 {
        plane = plane.flipped();
    }
    let z = plane.normal;
    let along = if z.x.abs() < 0.9 { Vec3::x() } else { Vec3::y() };
    let x = (along - z * z.dot(&along)).normalize();
    let rotation = Mat3::from_columns(&[x, z.cross(&x), z]);
    Ok(Rigid::new(rotation, z * plane.offset))
}
