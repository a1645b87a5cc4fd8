//! In: points of a cloud, a grid's pose. Out: integer sums of one surface in each cell of a height map. Frame and unit:
//! points in the base frame, mm; cells and heights in whole steps of the grid frame. Only sums and maxima of whole
//! numbers: the cells are the same on every machine and for any order of the points.

use super::entry::Case;
use crate::geometry::{Base, Grid, Rigid, Vec3};
use crate::gpu::Access::*;
use crate::gpu::{Binding, Field, Stage};

/// Layout of the cells in whole numbers; the WGSL struct of the same name, shaders/shared/grid.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct GridFrame {
    /// Cells along the grid's x axis.
    pub width: u32,
    /// Cells along the grid's y axis.
    pub height: u32,
    /// A cell that spans more height steps than this contains two surfaces.
    pub layer_steps: i32,
    /// Number of points.
    pub points: u32,
    /// Bits of the least quality: the bits of numbers that are not negative have the order of the numbers.
    pub least_quality: i32,
    /// The grid's origin in the base frame, in units of 2⁻¹⁴ mm, at most 2³⁰ of them: differences stay within 32 bits.
    pub origin_x: i32,
    /// The same along the base's y axis.
    pub origin_y: i32,
    /// The same along the base's z axis.
    pub origin_z: i32,
    /// Rows of the rotation over the cell's edge or the height step, each times a power of two with which it fills 30
    /// bits.
    pub xx: i32,
    /// Cells along x per distance along the base's y axis.
    pub xy: i32,
    /// Cells along x per distance along the base's z axis.
    pub xz: i32,
    /// Cells along y per distance along the base's x axis.
    pub yx: i32,
    /// Cells along y per distance along the base's y axis.
    pub yy: i32,
    /// Cells along y per distance along the base's z axis.
    pub yz: i32,
    /// Height steps per distance along the base's x axis.
    pub zx: i32,
    /// Height steps per distance along the base's y axis.
    pub zy: i32,
    /// Height steps per distance along the base's z axis.
    pub zz: i32,
    /// Exponent of that power of two plus the 14 binary places of positions.
    pub shift_x: u32,
    /// The same for the cells along y.
    pub shift_y: u32,
    /// The same for the height steps.
    pub shift_z: u32,
    /// The 64-bit offset of the cells along x, low 32 bits: it corrects the rounding of the origin.
    pub add_x_low: u32,
    /// The high 32 bits of that offset.
    pub add_x_high: u32,
    /// The same for the cells along y, low 32 bits.
    pub add_y_low: u32,
    /// The high 32 bits of that offset.
    pub add_y_high: u32,
    /// The same for the height steps, plus half a step, low 32 bits.
    pub add_z_low: u32,
    /// The high 32 bits of that offset.
    pub add_z_high: u32,
    /// Binary places of intensities: 4, or 0 if a sensor of 13 bits or more would saturate the terms.
    pub intensity_places: i32,
    /// Always 0: fills the block to a multiple of 16 bytes.
    pub reserved: u32,
}

const UNIFORM: (&str, &[Field], usize) = super::frame::uniform_fields!(GridFrame: width, height, layer_steps,
    points, least_quality,
    origin_x, origin_y, origin_z, xx, xy, xz, yx, yy, yz, zx, zy, zz, shift_x, shift_y, shift_z, add_x_low, add_x_high,
    add_y_low, add_y_high, add_z_low, add_z_high, intensity_places, reserved);

/// Binary places of positions, mm: steps of 0.06 µm.
const POSITION_PLACES: i32 = 14;
/// Unit of a sum of sigmas, mm; each term saturates at 65,461 units.
pub const SIGMA_STEP: f64 = 1e-4;
/// Largest integer height; the sum over [`COUNT_MOST`] points fits an i32.
pub const Z_MOST: i32 = 32_767;
/// With more points than this in one cell its sums could overflow.
pub const COUNT_MOST: u32 = 65_535;
/// Words of a point: x y z sigma intensity quality shot u v.
pub const RECORD: usize = 9;
/// Positions of at least this magnitude (32 m) are outside of every grid. So are points at that distance from the
/// origin, whose coordinates could exceed 32 bits.
pub(in crate::stages) const BEYOND: i32 = 0x2000_0000;

/// Sums of the points of one surface in one cell.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Layer {
    /// Number of points.
    pub count: u32,
    /// Sum of heights above the grid's plane, height steps.
    pub z: i32,
    /// Sum of grey levels in units of [`GridFrame::intensity_step`]; each term saturates at 65,535 units.
    pub intensity: u32,
    /// Sum of the points' standard deviations in units of [`SIGMA_STEP`].
    pub sigma: u32,
}

impl Layer {
    fn plus(self, o: Layer) -> Layer {
        Layer {
            count: self.count.wrapping_add(o.count),
            z: self.z.wrapping_add(o.z),
            intensity: self.intensity.wrapping_add(o.intensity),
            sigma: self.sigma.wrapping_add(o.sigma),
        }
    }
}

impl GridFrame {
    /// `cell` and `z_step` are in mm, at least 0.0001 and 1 / 32767. The frame has no points yet.
    pub fn new(
        base_from_grid: &Rigid<Base, Grid>,
        [width, height]: [u32; 2],
        (cell, z_step): (f64, f64),
        layer_steps: i32,
        min_quality: f32,
        most_intensity: f32,
    ) -> GridFrame {
        let unit = f64::from(1 << POSITION_PLACES);
        let origin =
            base_from_grid.translation.map(|v| (v * unit).round().clamp(-1_073_741_824.0, 1_073_741_824.0) as i32);
        let grid_from_base = base_from_grid.inverse();
        let rest = grid_from_base.point(&Vec3::from_fn(|i, _| f64::from(origin[i]) / unit));
        let row = |i: usize, step: f64, half: f64| {
            let r: [f64; 3] = std::array::from_fn(|k| grid_from_base.rotation[(i, k)] / step);
            let most = r.iter().fold(0f64, |m, v| m.max(v.abs()));
            let places = (30.0 - most.log2()).floor().min(40.0) as i32;
            let shift = places + POSITION_PLACES;
            let add = ((rest[i] / step + half) * 2f64.powi(shift)).round() as i64 as u64;
            (r.map(|v| (v * 2f64.powi(places)).round() as i32), shift as u32, [add as u32, (add >> 32) as u32])
        };
        let (x, shift_x, [add_x_low, add_x_high]) = row(0, cell, 0.0);
        let (y, shift_y, [add_y_low, add_y_high]) = row(1, cell, 0.0);
        let (z, shift_z, [add_z_low, add_z_high]) = row(2, z_step, 0.5);
        GridFrame {
            width,
            height,
            layer_steps,
            points: 0,
            least_quality: min_quality.max(0.0).to_bits() as i32,
            origin_x: origin.x,
            origin_y: origin.y,
            origin_z: origin.z,
            xx: x[0],
            xy: x[1],
            xz: x[2],
            yx: y[0],
            yy: y[1],
            yz: y[2],
            zx: z[0],
            zy: z[1],
            zz: z[2],
            shift_x,
            shift_y,
            shift_z,
            add_x_low,
            add_x_high,
            add_y_low,
            add_y_high,
            add_z_low,
            add_z_high,
            intensity_places: if most_intensity * 16.0 <= 65_535.0 { 4 } else { 0 },
            reserved: 0,
        }
    }

    /// Unit of a sum of intensities, grey levels.
    pub fn intensity_step(&self) -> f64 {
        1.0 / f64::from(1 << self.intensity_places)
    }

    /// Number of cells: width times height.
    pub fn cells(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Index of a point's cell, and the point's height + 32,768; `None` outside the grid.
    fn place(&self, p: &[u32]) -> Option<(usize, u32)> {
        let q = [p[0], p[1], p[2]].map(|bits| fixed(bits, POSITION_PLACES));
        let d: [i32; 3] = std::array::from_fn(|i| q[i] - [self.origin_x, self.origin_y, self.origin_z][i]);
        if q.iter().chain(&d).any(|v| v.abs() >= BEYOND) {
            return None;
        }
        let along = |row: [i32; 3], shift: u32, low: u32, high: u32| {
            let sum: i64 = (0..3).map(|i| i64::from(row[i]) * i64::from(d[i])).sum();
            (sum + ((u64::from(high) << 32 | u64::from(low)) as i64)) >> shift
        };
        let x = along([self.xx, self.xy, self.xz], self.shift_x, self.add_x_low, self.add_x_high);
        let y = along([self.yx, self.yy, self.yz], self.shift_y, self.add_y_low, self.add_y_high);
        let z = along([self.zx, self.zy, self.zz], self.shift_z, self.add_z_low, self.add_z_high);
        let inside = (0..i64::from(self.width)).contains(&x) && (0..i64::from(self.height)).contains(&y);
        let good = (self.least_quality..=0x7f80_0000).contains(&(p[5] as i32));
        (inside && good && z.abs() <= i64::from(Z_MOST))
            .then(|| (y as usize * self.width as usize + x as usize, (z + i64::from(Z_MOST) + 1) as u32))
    }

    /// First pass: lowest and highest point of each cell, in the format that `sum` and `pick` read.
    pub fn span(&self, records: &[u32], span: &mut [[u32; 2]]) {
        for (cell, z) in records.chunks_exact(RECORD).take(self.points as usize).filter_map(|p| self.place(p)) {
            let [low, high] = &mut span[cell];
            (*low, *high) = ((*low).max(65_536 - z), (*high).max(z));
        }
    }

    /// Second pass: sums below and above the middle of each cell's span.
    pub fn sum(&self, records: &[u32], span: &[[u32; 2]], layers: &mut [[Layer; 2]]) {
        for p in records.chunks_exact(RECORD).take(self.points as usize) {
            let Some((cell, z)) = self.place(p) else { continue };
            let ([low, high], z) = (span[cell], z as i32 - 32_768);
            let layer = &mut layers[cell][usize::from(2 * z > high as i32 - low as i32)];
            *layer = layer.plus(Layer {
                count: 1,
                z,
                intensity: fixed(p[4], self.intensity_places).clamp(0, 65_535) as u32,
                sigma: (fixed(p[3], 16).clamp(0, 429_000) as u32 * 10_000 + 32_768) >> 16,
            });
        }
    }

    /// One surface of each cell. Of two surfaces it is the one with more points, the upper one in a tie.
    pub fn pick(&self, [low, high]: [u32; 2], [below, above]: [Layer; 2]) -> Layer {
        let two = (low + high) as i32 - 65_536 > self.layer_steps;
        match two {
            false => below.plus(above),
            true if below.count > above.count => below,
            true => above,
        }
    }
}

/// The bits of an f32 as a multiple of 2^-places, rounded. A number that is too large, and NaN, give [`BEYOND`].
fn fixed(bits: u32, places: i32) -> i32 {
    let exponent = (bits >> 23 & 255) as i32;
    let mantissa = bits & 0x7f_ffff | 0x80_0000;
    let s = exponent - 150 + places;
    let size = match s {
        _ if exponent == 0 => 0,
        _ if s > 5 || exponent == 255 => BEYOND,
        0.. => (mantissa << s) as i32,
        _ => {
            let t = (-s).min(26);
            ((mantissa + (1 << (t - 1))) >> t) as i32
        }
    };
    if bits >> 31 == 1 { -size } else { size }
}

const fn stage(name: &'static str, wgsl: &'static str, bindings: &'static [Binding]) -> Stage {
    Stage {
        name,
        wgsl,
        shared: &[include_str!("../../shaders/shared/grid.wgsl")],
        workgroup: [64, 1, 1],
        bindings,
        uniform: UNIFORM,
        overrides: &[],
    }
}

const FRAME: Binding = Binding { name: "frame", access: Uniform };
const RECORDS: Binding = Binding { name: "records", access: Texels };

/// Lowest and highest point of each cell; one invocation per point.
pub const SPAN: Stage = stage(
    "grid_span",
    include_str!("../../shaders/grid_span.wgsl"),
    &[FRAME, RECORDS, Binding { name: "span", access: ReadWrite }],
);
/// Sums below and above the middle of each cell's span; one invocation per point.
pub const SUM: Stage = stage(
    "grid_sum",
    include_str!("../../shaders/grid_sum.wgsl"),
    &[FRAME, RECORDS, Binding { name: "span", access: Texels }, Binding { name: "layers", access: ReadWrite }],
);
/// Sums of one surface in each cell; one invocation per cell.
pub const PICK: Stage = stage(
    "grid_pick",
    include_str!("../../shaders/grid_pick.wgsl"),
    &[
        FRAME,
        Binding { name: "span", access: Texels },
        Binding { name: "layers", access: Texels },
        Binding { name: "cells", access: ReadWrite },
    ],
);

/// Workgroups for one invocation per point.
pub fn point_groups(points: u32) -> [u32; 3] {
    [points.div_ceil(64).max(1), 1, 1]
}

/// Workgroups for one invocation per cell; with more than 65,535 groups they are in several rows.
pub fn cell_groups(f: &GridFrame) -> [u32; 3] {
    let groups = (f.cells() as u32).div_ceil(64).max(1);
    [groups.min(65_535), groups.div_ceil(65_535), 1]
}

fn frame_of(b: &[Vec<u32>]) -> GridFrame {
    *bytemuck::from_bytes(bytemuck::cast_slice(&b[0]))
}

pub(crate) fn span_twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let [_, records, span] = b else { unreachable!() };
    f.span(records, bytemuck::cast_slice_mut(span));
}

pub(crate) fn sum_twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let [_, records, span, layers] = b else { unreachable!() };
    f.sum(records, bytemuck::cast_slice(span), bytemuck::cast_slice_mut(layers));
}

pub(crate) fn pick_twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let [_, span, layers, cells] = b else { unreachable!() };
    let (span, layers): (&[[u32; 2]], &[[Layer; 2]]) = (bytemuck::cast_slice(span), bytemuck::cast_slice(layers));
    let cells: &mut [Layer] = bytemuck::cast_slice_mut(cells);
    for i in 0..f.cells() {
        cells[i] = f.pick(span[i], layers[i]);
    }
}

/// Cases of one of the three stages: a tilted plate with a block and strays far from the base's origin; all points in
/// one cell; numbers that are not finite.
pub fn cases(stage: &str) -> Vec<Case> {
    let mut noise = super::noise::Noise(11);
    let mut normal = |sigma: f64| sigma * noise.normal();
    let tilt = Rigid::<Base, Grid>::from_vectors(&Vec3::new(0.2, -0.1, 0.3), Vec3::new(1400.0, -900.0, 60.0));
    let mut plate = Vec::new();
    for i in 0..4000 {
        let (x, y) = (0.31 * f64::from(i % 97), 0.37 * f64::from(i / 97));
        let z = if x > 12.0 && y < 9.0 { 3.0 } else { 0.0 } + if i % 50 == 0 { normal(20.0) } else { normal(0.02) };
        let p = tilt.point(&Vec3::new(x, y, z));
        plate.extend([p.x, p.y, p.z, 0.02, 40.0 + x, 0.5 + 0.01 * y].map(|v| (v as f32).to_bits()));
        plate.extend([0, 0, 0]);
    }
    let mut strange = Vec::new();
    for v in [f32::NAN, f32::INFINITY, -f32::INFINITY, 4e4, -4e4, 1e-40, -0.0, 0.7, 32_767.99, -1e30] {
        for k in 0..6 {
            let mut p = [1.5, 1.5, 0.1, 0.02, 80.0, 0.9];
            p[k] = v;
            strange.extend(p.map(f32::to_bits));
            strange.extend([0, 0, 0]);
        }
    }
    let flat = Rigid::<Base, Grid>::identity();
    [
        ("tilted plate", GridFrame::new(&tilt, [61, 43], (0.5, 0.001), 300, 0.0, 80.0), &plate),
        ("one cell, quality", GridFrame::new(&tilt, [1, 1], (50.0, 0.003), 100, 0.6, 60_000.0), &plate),
        ("numbers that are not finite", GridFrame::new(&flat, [5, 3], (1.0, 1.0 / 32_767.0), 10, 0.0, 255.0), &strange),
    ]
    .into_iter()
    .map(|(name, mut f, records)| {
        f.points = (records.len() / RECORD) as u32;
        let (mut span, mut layers) = (vec![[0; 2]; f.cells()], vec![[Layer::default(); 2]; f.cells()]);
        if stage != SPAN.name {
            f.span(records, &mut span);
        }
        if stage == PICK.name {
            f.sum(records, &span, &mut layers);
        }
        let words = |v: &[[u32; 2]]| bytemuck::cast_slice(v).to_vec();
        let mut bindings = vec![bytemuck::cast_slice::<GridFrame, u32>(&[f]).to_vec()];
        bindings.extend((stage != PICK.name).then(|| records.clone()));
        bindings.push(words(&span));
        bindings.extend((stage != SPAN.name).then(|| bytemuck::cast_slice(&layers).to_vec()));
        bindings.extend((stage == PICK.name).then(|| vec![0; 4 * f.cells()]));
        let groups = if stage == PICK.name { cell_groups(&f) } else { point_groups(f.points) };
        Case { name: name.into(), overrides: Vec::new(), bindings, groups }
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fixed_point_is_the_rounded_number() {
        for v in [0.0f32, 1.0, -1.0, 0.1, -123.456, 1999.99, -0.000_03, 0.000_031, 3.5e-5, 32_767.0] {
            let exact = f64::from(v) * 16_384.0;
            assert!((f64::from(fixed(v.to_bits(), 14)) - exact).abs() <= 0.5, "{v}");
        }
        for v in [f32::NAN, f32::INFINITY, 40_000.0] {
            assert_eq!(fixed(v.to_bits(), 14), BEYOND, "{v}");
        }
        assert_eq!(fixed((-f32::INFINITY).to_bits(), 14), -BEYOND);
    }

    #[test]
    fn cells_and_heights_are_those_of_plain_geometry() {
        let pose = Rigid::<Base, Grid>::from_vectors(&Vec3::new(1.2, -0.4, 2.3), Vec3::new(-700.0, 1300.0, 250.0));
        let (cell, step) = (0.05, 0.0004);
        let f = GridFrame::new(&pose, [900, 700], (cell, step), 100, 0.0, 255.0);
        let mut noise = super::super::noise::Noise(3);
        let mut next = |range: f64| range * f64::from(noise.next() % 100_000) / 100_000.0;
        for _ in 0..2000 {
            let local = Vec3::new(next(45.0), next(35.0), next(20.0) - 10.0);
            let p = pose.point(&local).map(|v| v as f32);
            let words = [p.x, p.y, p.z, 0.01, 10.0, 1.0].map(f32::to_bits);
            let (at, z) = f.place(&words).expect("inside");
            let seen = pose.inverse().point(&p.map(f64::from));
            // The positions have a step of 0.06 µm; a point closer than that to a cell's edge may fall on either side.
            let off = |i: usize, axis: f64| (axis / cell - i as f64 - 0.5).abs() * cell - 0.5 * cell;
            assert!(off(at % 900, seen.x) < 2e-4 && off(at / 900, seen.y) < 2e-4, "{at} {seen}");
            assert!((f64::from(z) - 32_768.0 - seen.z / step).abs() < 0.5 + 2e-4 / step, "{z} {seen}");
        }
    }
}
