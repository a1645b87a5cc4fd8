//! In: the pictures' layout, the settings of peaks and of their choice. Out: the uniform block of the stages lines and
//! peak, with every size computed once. Frame and unit: pixels, grey levels of the picture's depth.

use super::across::turn::{WEIGHTS, deep, flattest, turn};
use super::params::{PeakParams, SAMPLES};
use crate::gpu::Field;
use crate::stages::frame::px_log2;
use crate::stages::stripe::choose_params::ChooseParams;
use crate::stages::stripe::thin::slanted;
use glam::Vec2;

/// The noise model counts like this many samples, because a profile's few samples alone show little of the noise.
const BELIEF: f32 = 10.0;
/// The same if the noise is correlated from sample to sample.
const GRAINED: f32 = 1e4;

/// Share of the gradients on a straight stripe that do not point across it: without noise, and per square of the
/// speckle's contrast. Measured on stripes of 0.7 and 2 px at 0 to 60 degrees, contrasts of 0 to 0.5.
const ROUGH: f32 = 0.02;
const SPECKLED: f32 = 0.75;

/// The WGSL struct of the same name, shaders/shared/peaks.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct PeakFrame {
    /// Width of the picture, px.
    pub width: i32,
    /// Height of the picture, px.
    pub height: i32,
    /// Words of one picture row.
    pub pitch: u32,
    /// Words of one picture.
    pub shot_words: u32,
    /// Expected sigma of the profile, px.
    pub s0: f32,
    /// Grey level of saturation.
    pub full_scale: f32,
    /// Variance of read noise; grey levels squared.
    pub read2: f32,
    /// Variance of shot noise per grey level.
    pub gain: f32,
    /// Square of the speckle contrast, 0..=1, times the square of the factor that its grains add.
    pub speckle2: f32,
    /// Number of samples that the noise model counts for.
    pub belief: f32,
    /// 1 / R², px⁻²; the weight along the stripe is (1 - t² / R²)², close to a Gaussian of sigma R / 2.4.
    pub along_factor: f32,
    /// Half window along the stripe, px; 0 if only one line across it is read.
    pub radius: f32,
    /// Spacing along the rows of the grey levels from which the direction is computed, px.
    pub lattice_u: i32,
    /// The same spacing along the columns, px.
    pub lattice_v: i32,
    /// Step between the background's samples, px.
    pub stride: i32,
    /// Most Gauss-Newton steps, 1..=20.
    pub steps: u32,
    /// Least amplitude of a peak, grey levels of the picture's depth.
    pub faintest: f32,
    /// Least sigma of the profile, px.
    pub narrowest: f32,
    /// Largest sigma of the profile, px.
    pub widest: f32,
    /// Largest standard deviation of a centre, px.
    pub uncertain: f32,
    /// Least cosine of the angle between a peak's normal and the direction of depth.
    pub upright: f32,
    /// Direction of depth in the picture, a unit vector: its component along the rows.
    pub across_u: f32,
    /// Its component along the columns.
    pub across_v: f32,
    /// Number of lines across the stripe in one picture.
    pub lines: u32,
    /// 1 if those lines are columns, 0 if they are rows.
    pub columns: u32,
    /// Entries of the list of strongest peaks, over all shots.
    pub entries: u32,
    /// Columns or rows in a line, about a stripe's width. Finer lines are not needed for the strongest peak within five
    /// widths.
    pub line_px: u32,
    /// Groups of four columns over which a profile is summed; 0 if the stripe is so narrow that columns are read one by
    /// one.
    pub fours: i32,
    /// Half the length of an upright stripe's profile, samples.
    pub half_across: f32,
    /// Neighbouring rows that form one sample of the profile.
    pub rows: i32,
    /// Correction of the measured direction, rad: coefficient of the sine of twice its angle.
    pub turn_2: f32,
    /// The same for the sine of four times the angle.
    pub turn_4: f32,
    /// The same for the sine of six times the angle.
    pub turn_6: f32,
    /// The same for the sine of eight times the angle.
    pub turn_8: f32,
    /// For steep stripes, on a square lattice: coefficient for four times the angle.
    pub square_4: f32,
    /// For steep stripes, on a square lattice: coefficient for eight times the angle.
    pub square_8: f32,
    /// Cosine of twice the angle up to which a stripe counts as flat; below -1 if no stripe does.
    pub flat: f32,
    /// Share of a straight stripe's gradients that do not point across it, for its speckle.
    pub ragged: f32,
    /// What read noise adds to the sum of the squared gradients; grey levels squared, with ten bits a gradient.
    pub restless: f32,
}

/// WGSL name, members and bytes of [`PeakFrame`], for the contract tests.
pub const UNIFORM: (&str, &[Field], usize) = crate::stages::frame::uniform_fields!(PeakFrame: width, height, pitch,
    shot_words, s0, full_scale,
    read2, gain, speckle2, belief, along_factor, radius, lattice_u, lattice_v, stride, steps, faintest, narrowest,
    widest, uncertain, upright, across_u, across_v, lines, columns, entries,
    line_px, fours, half_across,
    rows, turn_2, turn_4, turn_6, turn_8, square_4, square_8, flat, ragged, restless);

impl PeakFrame {
    /// Quads of samples of a profile, which the shader has unrolled: samples -2 quads to 2 quads - 1, so that the
    /// shorter side still contains all of an upright profile. They contain all of a profile on lines up to 31 degrees
    /// off an image axis. Beyond that the outermost flanks are excluded, at 45 degrees those from 2.5 widths on.
    pub fn quads(&self) -> i32 {
        let upright = self.half_across.ceil() + 1.0;
        ((0.5 * (self.half_across / 0.86).max(upright)).ceil() as i32).clamp(1, SAMPLES as i32 / 4)
    }
    /// Whole pixels of half a window along the stripe.
    pub(super) fn reach_along(&self) -> i32 {
        self.radius.floor() as i32
    }
    /// `across`: unit image direction of depth ([`crate::stages::stripe::point::Optics::across`]).
    pub fn new(
        (width, height, bits): (u32, u32, u8),
        shots: u32,
        p: &PeakParams,
        c: &ChooseParams,
        across: Vec2,
    ) -> PeakFrame {
        let full_scale = ((1u32 << bits) - 1) as f32;
        // Levels of the pictures in one of an 8-bit picture of one exposure.
        let scale = full_scale / 255.0 / p.levels.span;
        let s0 = p.width_px;
        // A window whose middle lies between two pixels contains at least one of them.
        let radius = if p.along > 0.0 { (2.4 * p.along * s0).max(1.0) } else { 0.0 };
        let pitch = (width.div_ceil(32) * 32) >> px_log2(bits);
        // Lines across the stripe are image columns, or rows if the laser's direction of depth is closer to the rows.
        let columns = across[1].abs() >= across[0].abs();
        let line_px = s0.floor().max(1.0);
        let lines = (if columns { width } else { height }).div_ceil(line_px as u32);
        // Over nearly three widths: noise and speckle then turn the direction least, and a Gaussian has little detail
        // left between samples that far apart. Along a stripe in its expected direction there is room for half as much
        // again.
        let (lattice_across, lattice_along) = ((1.4 * s0).round().max(1.0) as i32, (2.1 * s0).round().max(2.0) as i32);
        let square = (lattice_across, lattice_across);
        let [square_4, square_8] = turn(s0, square, [4.0, 8.0], std::f64::consts::FRAC_PI_4, false);
        let (lattice, [turn_2, turn_4, turn_6, turn_8], flat) = if slanted(across) {
            // Such a stripe runs along neither image axis.
            (square, [0.0, square_4, 0.0, square_8], -2.0)
        } else {
            let (steepest, seen) = flattest(s0, (lattice_along, lattice_across));
            let lattice = if columns { (lattice_along, lattice_across) } else { (lattice_across, lattice_along) };
            // A stripe that seems flat may be three degrees steeper.
            (lattice, turn(s0, lattice, [2.0, 4.0, 6.0, 8.0], steepest + 0.05, !columns), (2.0 * seen).cos())
        };
        let read2 = p.read_noise * p.read_noise * scale * scale;
        // Rows within 0.4 widths form one sample: their spread is known and hardly increases sigma. With more than two
        // rows so few samples would remain that their scatter says little about the noise.
        let rows = (0.4 * s0).floor().clamp(1.0, 2.0);
        PeakFrame {
            width: width as i32,
            height: height as i32,
            pitch,
            shot_words: pitch * height,
            s0,
            full_scale,
            read2,
            gain: p.gain * scale,
            speckle2: (p.speckle * p.grain).powi(2),
            // One profile's scatter does not show noise whose grains extend over several of its samples.
            belief: if p.grain > 1.0 { GRAINED } else { BELIEF },
            // One line across the stripe needs no weights.
            along_factor: if p.along > 0.0 { 1.0 / (radius * radius) } else { 0.0 },
            radius,
            lattice_u: lattice.0,
            lattice_v: lattice.1,
            // A background level less certain than a sample of the profile would make the fit look worse than it is.
            stride: (0.7 * s0).round().clamp(1.0, 2.0) as i32,
            steps: p.steps,
            faintest: c.faintest * scale,
            narrowest: c.narrowest * s0,
            widest: c.widest * s0,
            uncertain: c.uncertain * s0,
            upright: c.steepest_deg.to_radians().cos(),
            across_u: across[0],
            across_v: across[1],
            lines,
            columns: u32::from(columns),
            entries: lines * shots,
            line_px: line_px as u32,
            // Groups start at multiples of four, so that the window is up to two pixels off the skeleton pixel. Five
            // sixths of it, which hold 99 % of the weight, must be present on the shorter side as well.
            fours: if radius >= 4.0 { (0.415 * radius + 1.5) as i32 } else { 0 },
            // The fit uses three widths; the skeleton may be one pixel beside the centre.
            half_across: (4.0 * s0).min(3.0 * s0 + 1.0) / rows,
            rows: rows as i32,
            turn_2,
            turn_4,
            turn_6,
            turn_8,
            square_4,
            square_8,
            flat: flat as f32,
            ragged: ROUGH + SPECKLED * p.speckle * p.speckle,
            restless: 2.0 * WEIGHTS * read2 / f32::from(1u16 << deep(full_scale)).powi(2),
        }
    }
}

/// WGSL text of the structs `PeakFrame` and `Peak`.
pub const SHARED: &str = include_str!("../../../shaders/shared/peaks.wgsl");

/// The peak frame's words in a twin's bindings.
pub(crate) fn frame_of(b: &[Vec<u32>]) -> PeakFrame {
    *bytemuck::from_bytes(bytemuck::cast_slice(&b[0]))
}
