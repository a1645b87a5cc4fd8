//! In: the name of a scene, a size, a depth. Out: the lines of light in each of its pictures, exactly, and the rig that
//! sees them. Frame and unit: px (0 is the middle of the first pixel), grey levels as a share of full scale, mm.

use super::wire::{CameraHeader, FORMAT, Header, PlaneHeader, Scenario};
use sheetlight::camera::{Distortion, Intrinsics};
use sheetlight::geometry::{Camera, Plane, Vec2, Vec3};

/// What the pictures show. Numbers as a share of full scale: peak 0.7, background 0.04, read noise 0.008, where nothing
/// else is said. The stripe's profile is a Gaussian of sigma 2.5 px.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    serde::Serialize,
    serde::Deserialize,
    strum::EnumString,
    strum::IntoStaticStr,
    strum::VariantArray,
)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case", parse_err_ty = String, parse_err_fn = unknown)]
pub enum SceneKind {
    /// One curved stripe with a step.
    Clean,
    /// The same at a peak of 0.08.
    Dim,
    /// The same with speckle: contrast 0.5, grains of 1.7 px.
    Speckle,
    /// The same with a sigma of 6 px.
    Thick,
    /// A stripe that crosses the picture at 42 degrees.
    Slanted,
    /// Two stripes above each other, the lower one with a peak of 0.45.
    TwoStripes,
    /// One stripe, bright spots, and a weak second line three times as wide: light that a surface has scattered.
    Reflections,
    /// One stripe in noise so strong that a tenth of all pixels is brighter than its surroundings by 3 %.
    TenthLit,
    /// No stripe: background and noise alone.
    Dark,
}

fn unknown(word: &str) -> String {
    sheetlight::fault::unknown::<SceneKind>("scene", word)
}

impl SceneKind {
    /// The name in options and files.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Sigma of the stripe's profile, px.
    pub(super) fn sigma_px(self) -> f64 {
        if self == SceneKind::Thick { 6.0 } else { 2.5 }
    }

    /// Peak of the first stripe, share of full scale.
    pub(super) fn peak(self) -> f64 {
        if self == SceneKind::Dim { 0.08 } else { 0.7 }
    }

    /// Background and its noise, share of full scale.
    pub(super) fn background(self) -> [f64; 2] {
        if self == SceneKind::TenthLit { [0.12, 0.0275] } else { [0.04, 0.008] }
    }
}

/// One scene at one size and depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Task {
    /// What the pictures show.
    pub scene: SceneKind,
    /// Columns, px.
    pub width: u32,
    /// Rows, px.
    pub height: u32,
    /// Bits of a pixel, 8..=16.
    pub bits: u8,
}

/// Slope of the slanted stripe: tan(42 degrees).
const SLANT: f64 = 0.900_404_044_3;
/// Half of the gap at the step, px.
const GAP_PX: f64 = 6.0;

/// A line of laser light: `v = base + wave * sin(5 u / width + phase) + slope * u` between two columns.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    base: f64,
    wave: f64,
    phase: f64,
    slope: f64,
    width: f64,
    /// First and last column, px.
    pub from: f64,
    pub to: f64,
    /// Peak, share of full scale.
    pub peak: f64,
}

impl Line {
    /// Row of the line's middle at a column, px.
    pub fn row(&self, u: f64) -> f64 {
        self.base + self.wave * libm::sin(5.0 * u / self.width + self.phase) + self.slope * u
    }

    /// Rows a column.
    pub fn slope(&self, u: f64) -> f64 {
        self.slope + self.wave * 5.0 / self.width * libm::cos(5.0 * u / self.width + self.phase)
    }

    /// The same line at other rows, between other columns.
    pub fn moved(self, rows: f64, from: f64, to: f64, peak: f64) -> Line {
        Line { base: self.base + rows, from, to, peak, ..self }
    }
}

impl Task {
    /// A clean scene of this size, for tests.
    #[cfg(test)]
    pub fn example(width: u32, height: u32, bits: u8) -> Task {
        Task { scene: SceneKind::Clean, width, height, bits }
    }

    /// The name in messages and files.
    pub fn name(&self) -> String {
        format!("{} {}x{} {} bit", self.scene.name(), self.width, self.height, self.bits)
    }

    /// Number of different pictures: fewer of large ones.
    pub fn pictures(&self) -> u32 {
        (10_000_000 / (u64::from(self.width) * u64::from(self.height))).clamp(4, 32) as u32
    }

    /// Lines of true laser light in picture `number`.
    pub(super) fn lines(&self, number: u32) -> Vec<Line> {
        let (width, height) = (f64::from(self.width), f64::from(self.height));
        let phase = 0.7 * f64::from(number);
        let peak = self.scene.peak();
        let end = width - 1.0;
        let curve =
            Line { base: 0.5 * height, wave: 0.12 * height, phase, slope: 0.0, width, from: 0.0, to: end, peak };
        let step = 0.6 * width;
        match self.scene {
            SceneKind::Dark => Vec::new(),
            SceneKind::Slanted => {
                let base = 0.5 * height - SLANT * 0.5 * width + 0.02 * height * libm::sin(phase);
                let line = Line { base, wave: 0.02 * height, slope: SLANT, ..curve };
                // Only what stands whole in the picture: three sigma from the borders.
                let margin = 3.0 * self.scene.sigma_px();
                let inside = |u: &u32| (margin..=height - 1.0 - margin).contains(&line.row(f64::from(*u)));
                let mut columns = (0..self.width).filter(inside);
                let from = columns.next();
                let ends = from.map(|from| [from, columns.next_back().unwrap_or(from)].map(f64::from));
                ends.map(|[from, to]| Line { from, to, ..line }).into_iter().collect()
            }
            SceneKind::TwoStripes => vec![
                Line { base: 0.33 * height, wave: 0.08 * height, ..curve },
                Line { base: 0.67 * height, wave: 0.08 * height, peak: 0.45, ..curve },
            ],
            _ => vec![Line { to: step - GAP_PX, ..curve }, curve.moved(0.08 * height, step + GAP_PX, end, peak)],
        }
    }

    /// The camera, as entries get it.
    pub(super) fn camera(&self) -> Intrinsics {
        let (width, height) = (f64::from(self.width), f64::from(self.height));
        Intrinsics {
            fx: 0.96 * width,
            fy: 0.96 * width,
            cx: 0.49 * width,
            cy: 0.51 * height,
            skew: 0.0,
            distortion: Distortion::from_opencv(&LENS).expect("five terms"),
            width: self.width,
            height: self.height,
        }
    }

    /// The laser plane, as entries get it.
    pub(super) fn plane(&self) -> Plane<Camera> {
        let [x, y] = if self.scene == SceneKind::Slanted { [-SIN_SLANT, COS_SLANT] } else { [0.0, 1.0] };
        Plane::new(Vec3::new(0.8828 * x, 0.8828 * y, 0.4694), 72.15).expect("a normal")
    }

    /// The header that an entry reads.
    pub(super) fn header(&self, scenario: Scenario) -> Header {
        let (k, plane) = (self.camera(), self.plane());
        Header {
            sheetlight_bench: FORMAT,
            width: self.width,
            height: self.height,
            bits: self.bits,
            scenario,
            camera: CameraHeader { fx: k.fx, fy: k.fy, cx: k.cx, cy: k.cy, distortion: LENS },
            plane: PlaneHeader { normal: plane.normal.into(), offset_mm: plane.offset },
        }
    }

    /// The exact point that a place in the picture shows, mm; `None` where its ray misses the plane.
    pub(super) fn point(&self, u: f64, v: f64) -> Option<Vec3> {
        self.camera().ray_from_pixel(&Vec2::new(u, v))?.meet(&self.plane())
    }
}

/// k1, k2, p1, p2, k3.
const LENS: [f64; 5] = [-0.118, 0.086, 0.00062, -0.00041, -0.017];
/// Sine and cosine of 42 degrees.
const SIN_SLANT: f64 = 0.669_130_606_4;
const COS_SLANT: f64 = 0.743_144_825_5;

#[cfg(test)]
mod tests {
    use super::*;
    use strum::VariantArray;

    #[test]
    fn every_line_stands_in_the_picture_and_on_the_plane_before_the_camera() {
        for &scene in SceneKind::VARIANTS {
            for (width, height) in [(640, 480), (480, 640), (4096, 3072)] {
                let task = Task { scene, width, height, bits: 8 };
                for line in (0..task.pictures()).flat_map(|n| task.lines(n)) {
                    assert!(line.to - line.from > 0.3 * f64::from(width), "{} {line:?}", task.name());
                    for u in [line.from, 0.5 * (line.from + line.to), line.to] {
                        let v = line.row(u);
                        assert!(v > 6.0 && v < f64::from(height) - 7.0, "{} {u} {v}", task.name());
                        let p = task.point(u, v).unwrap();
                        assert!((50.0..800.0).contains(&p.z), "{} {p}", task.name());
                        let slope = (line.row(u + 1e-4) - line.row(u - 1e-4)) / 2e-4;
                        assert!((slope - line.slope(u)).abs() < 1e-6);
                    }
                }
            }
        }
    }
}
