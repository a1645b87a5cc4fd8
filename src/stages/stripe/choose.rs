//! In: the peaks of one shot. Out: the same peaks; rejected ones are marked with the reason. On the GPU the stages peak
//! and point do this. Frame and unit: image pixels; grey levels of the picture's depth; widths relative to the
//! stripe's.

use super::choose_params::ChooseParams;
use crate::gpu::Access::*;
use crate::gpu::{Binding, Stage};
use crate::stages::peak::found::{Peak, Reject};
use crate::stages::peak::params::PeakParams;
use crate::stages::peak::{PeakFrame, SHARED, UNIFORM, frame_of};
use glam::Vec2;

/// The properties of picture, stripe and laser that the tests use.
#[derive(Clone, Copy, Debug)]
pub struct Scene {
    /// Width of the picture, px.
    pub width: u32,
    /// Height of the picture, px.
    pub height: u32,
    /// Grey level of saturation.
    pub full_scale: f32,
    /// The stripe's Gaussian sigma, px.
    pub width_px: f32,
    /// Unit image direction of depth: the laser plane's normal in the camera frame without its z component.
    pub across: Vec2,
}

impl Scene {
    fn frame(&self, p: &ChooseParams) -> PeakFrame {
        let bits = (self.full_scale as u32 + 1).ilog2() as u8;
        let peak = PeakParams { width_px: self.width_px, ..PeakParams::default() };
        PeakFrame::new((self.width, self.height, bits), 1, &peak, p, self.across)
    }
}

/// CPU twin, in two passes as on the GPU: first each peak alone and the strongest of each line, then the peaks that are
/// weak beside another.
pub fn choose(peaks: &mut [Peak], scene: &Scene, p: &ChooseParams) {
    let frame = scene.frame(p);
    let lines = Lines::new(&frame, p);
    let mut strongest = vec![0u32; frame.lines as usize];
    for k in peaks.iter_mut() {
        alone(k, &frame, &mut strongest);
    }
    for k in peaks.iter_mut() {
        beside(k, &strongest, &lines);
    }
}

/// The line across the stripe that a skeleton pixel lies on.
fn line_of(pixel: u32, columns: u32, line_px: u32) -> usize {
    ((if columns != 0 { pixel & 0xffff } else { pixel >> 16 }) / line_px) as usize
}

/// The tests that need no other peak. A peak that passes them counts for the strongest of its line. Amplitudes are
/// positive, so their bits have the order of their values.
pub(in crate::stages) fn alone(k: &mut Peak, f: &PeakFrame, strongest: &mut [u32]) {
    k.refuse(reason(k, f));
    if k.kept() {
        let s = &mut strongest[line_of(k.pixel, f.columns, f.line_px)];
        *s = (*s).max(k.amplitude.to_bits());
    }
}

/// The result of the tests on a peak's own numbers.
pub(in crate::stages) fn reason(k: &Peak, f: &PeakFrame) -> Reject {
    let across = k.normal_u * f.across_u + k.normal_v * f.across_v;
    if k.amplitude < f.faintest {
        Reject::Faint
    } else if k.width_px < f.narrowest {
        Reject::Narrow
    } else if k.width_px > f.widest {
        Reject::Wide
    } else if !(k.sigma_px <= f.uncertain) {
        Reject::Uncertain
    } else if across.abs() < f.upright {
        Reject::Steep
    } else {
        Reject::Kept
    }
}

/// The lines across the stripe of a shot, and the limits of a peak relative to the strongest nearby.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lines {
    /// Number of lines, as in [`PeakFrame`].
    pub lines: u32,
    /// As in [`PeakFrame`]: 1 if the lines are columns, 0 if they are rows.
    pub columns: u32,
    /// Columns or rows in a line, px, as in [`PeakFrame`].
    pub line_px: u32,
    /// Half the window in which the strongest peak is searched, lines.
    pub reach: i32,
    /// Least amplitude over the strongest of those lines, 0..=1.
    pub echo: f32,
    /// Width below which a peak may be a spot cut by an edge, px.
    pub cut_width: f32,
    /// Least amplitude of such a narrow peak over the strongest of those lines, 0..=1.
    pub cut_amplitude: f32,
}

impl Lines {
    /// Converts the settings to px and lines of the pictures of `f`.
    pub fn new(f: &PeakFrame, p: &ChooseParams) -> Lines {
        Lines {
            lines: f.lines,
            columns: f.columns,
            line_px: f.line_px,
            reach: (p.echo_reach * f.s0 / f.line_px as f32 + 0.5).floor() as i32,
            echo: p.echo,
            cut_width: p.cut_width * f.s0,
            cut_amplitude: p.cut_amplitude,
        }
    }
}

/// The tests against the strongest peak of the lines nearby; `strongest` has those of the peak's shot.
pub(in crate::stages) fn beside(k: &mut Peak, strongest: &[u32], l: &Lines) {
    let at = line_of(k.pixel, l.columns, l.line_px);
    let reach = l.reach as usize;
    let near = &strongest[at.saturating_sub(reach)..=(at + reach).min(l.lines as usize - 1)];
    let top = f32::from_bits(near.iter().fold(0, |a, &b| a.max(b)));
    if k.amplitude < l.echo * top {
        k.refuse(Reject::Echo);
    } else if k.width_px < l.cut_width && k.amplitude < l.cut_amplitude * top {
        k.refuse(Reject::Narrow);
    }
}

/// WGSL of [`line_of`] for the stages peak and point.
pub(in crate::stages) const LINE_OF: &str = include_str!("../../../shaders/shared/line_of.wgsl");

/// Empties the list of the strongest peaks.
pub const LINES: Stage = Stage {
    name: "lines",
    wgsl: include_str!("../../../shaders/lines.wgsl"),
    shared: &[SHARED],
    workgroup: [64, 1, 1],
    bindings: &[Binding { name: "frame", access: Uniform }, Binding { name: "strongest", access: ReadWrite }],
    uniform: UNIFORM,
    overrides: &[],
};

/// Workgroups that cover the list.
pub fn lines_groups(f: &PeakFrame) -> [u32; 3] {
    LINES.groups([f.entries, 1, 1])
}

pub(crate) fn lines_twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let f = frame_of(b);
    b[1][..f.entries as usize].fill(0);
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: Scene = Scene { width: 64, height: 48, full_scale: 255.0, width_px: 1.0, across: Vec2::new(0.0, 1.0) };

    fn peak(x: u32, amplitude: f32, width_px: f32) -> Peak {
        let normal_v = 1.0;
        Peak { pixel: x | 20 << 16, amplitude, width_px, sigma_px: 0.05, normal_v, ..Peak::default() }
    }
    fn reason(of: Peak, among: &[Peak]) -> Reject {
        let mut peaks = among.to_vec();
        peaks.push(of);
        choose(&mut peaks, &SCENE, &ChooseParams::default());
        peaks.last().unwrap().reject()
    }

    #[test]
    fn each_fault_has_its_reason() {
        assert_eq!(reason(peak(9, 100.0, 1.0), &[]), Reject::Kept);
        assert_eq!(reason(peak(9, 5.0, 1.0), &[]), Reject::Faint);
        assert_eq!(reason(peak(9, 100.0, 0.4), &[]), Reject::Narrow);
        assert_eq!(reason(peak(9, 100.0, 1.9), &[]), Reject::Wide);
        assert_eq!(reason(Peak { sigma_px: 1.5, ..peak(9, 100.0, 1.0) }, &[]), Reject::Uncertain);
        assert_eq!(reason(Peak { sigma_px: f32::NAN, ..peak(9, 100.0, 1.0) }, &[]), Reject::Uncertain);
        assert_eq!(reason(Peak { normal_u: 0.995, normal_v: 0.1, ..peak(9, 100.0, 1.0) }, &[]), Reject::Steep);
    }

    #[test]
    fn an_echo_is_weak_beside_the_stripe_on_its_line() {
        let stripe = [peak(10, 200.0, 1.0)];
        assert_eq!(reason(peak(12, 20.0, 1.0), &stripe), Reject::Echo);
        assert_eq!(reason(peak(30, 20.0, 1.0), &stripe), Reject::Kept);
        assert_eq!(reason(peak(12, 40.0, 1.0), &stripe), Reject::Kept);
        // A peak that is rejected alone does not count as the strongest.
        assert_eq!(reason(peak(12, 20.0, 1.0), &[peak(10, 200.0, 0.3)]), Reject::Kept);
    }

    #[test]
    fn a_cut_spot_has_lost_light_and_width() {
        let stripe = [peak(10, 200.0, 1.0)];
        assert_eq!(reason(peak(11, 60.0, 0.8), &stripe), Reject::Narrow);
        assert_eq!(reason(peak(11, 60.0, 1.0), &stripe), Reject::Kept);
        assert_eq!(reason(peak(11, 150.0, 0.8), &stripe), Reject::Kept);
    }

    #[test]
    fn a_stripe_along_the_columns_is_judged_by_rows() {
        let scene = Scene { across: Vec2::new(1.0, 0.0), ..SCENE };
        let at = |x: u32, y: u32, amplitude: f32| Peak {
            pixel: x | y << 16,
            normal_u: 1.0,
            normal_v: 0.0,
            ..peak(0, amplitude, 1.0)
        };
        let mut peaks = vec![at(30, 5, 200.0), at(50, 5, 20.0), at(30, 40, 20.0)];
        choose(&mut peaks, &scene, &ChooseParams::default());
        assert_eq!(peaks.iter().map(Peak::reject).collect::<Vec<_>>(), [Reject::Kept, Reject::Echo, Reject::Kept]);
    }
}
