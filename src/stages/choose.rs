//! In: the peaks of one shot. Out: the same peaks, those not believed marked with the reason.
//! Frame and unit: image pixels; grey levels of the picture's depth; widths relative to the stripe's.

use super::peak::{Peak, Reject};
use crate::fault::{Fault, Result};

/// What a peak of the laser looks like, against reflections, glints, hot pixels and mixed spots.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ChooseParams {
    /// Least amplitude, 0..=255 grey levels of an 8-bit picture; below about ten times the read noise specks survive.
    pub faintest: f32,
    /// Least profile sigma over the stripe's, 0..=1. A hot pixel has 0.4, a spot cut by an edge 0.7 to 0.9.
    pub narrowest: f32,
    /// Largest profile sigma over the stripe's, 1..=3. Two stripes that run together have 1.5 and more.
    pub widest: f32,
    /// Profile sigma over the stripe's, 0..=1, below which a peak may be a spot cut by an edge; and the amplitude over
    /// the strongest nearby, 0..=1, that it then needs. What is left of a cut spot has lost width and light at once,
    /// and its centre is off the sheet's centre by up to a beam radius.
    pub cut_width: f32,
    pub cut_amplitude: f32,
    /// Largest standard deviation of a centre over the stripe's sigma, 0.01..=2.
    pub uncertain: f32,
    /// Largest angle between a stripe and the image of a surface that faces the camera, 0..=90 degrees. Beyond it the
    /// stripe runs along the direction of depth, where walls and reflections of the sheet lie.
    pub steepest_deg: f32,
    /// Least amplitude over the strongest peak on the same line across the stripe, 0..=1: light that comes by way of
    /// another surface has lost most of its power.
    pub echo: f32,
    /// How far along the stripe that line reaches, stripe sigmas, 0..=100.
    pub echo_reach: f32,
}

impl Default for ChooseParams {
    fn default() -> Self {
        ChooseParams {
            faintest: 8.0,
            narrowest: 0.71,
            widest: 1.7,
            cut_width: 0.88,
            cut_amplitude: 0.4,
            uncertain: 0.43,
            steepest_deg: 70.0,
            echo: 0.12,
            echo_reach: 5.7,
        }
    }
}

impl ChooseParams {
    pub fn check(&self) -> Result<()> {
        for (name, value, low, high) in [
            ("faintest", self.faintest, 0.0, 255.0),
            ("narrowest", self.narrowest, 0.0, 1.0),
            ("widest", self.widest, 1.0, 3.0),
            ("cut_width", self.cut_width, 0.0, 1.0),
            ("cut_amplitude", self.cut_amplitude, 0.0, 1.0),
            ("uncertain", self.uncertain, 0.01, 2.0),
            ("steepest_deg", self.steepest_deg, 0.0, 90.0),
            ("echo", self.echo, 0.0, 1.0),
            ("echo_reach", self.echo_reach, 0.0, 100.0),
        ] {
            if !(low..=high).contains(&value) {
                return Err(Fault::usage(format!("choose {name} is {value}, it must be in {low}..={high}")));
            }
        }
        Ok(())
    }
}

/// What the step knows about picture, stripe and laser.
#[derive(Clone, Copy, Debug)]
pub struct Scene {
    pub width: u32,
    pub height: u32,
    /// Grey level of saturation.
    pub full_scale: f32,
    /// The stripe's Gaussian sigma, px.
    pub width_px: f32,
    /// Unit image direction of depth: the laser plane's normal in the camera frame without its z component.
    pub across: [f32; 2],
}

/// CPU twin, two passes as on the GPU: each peak by itself and the strongest of each line, then those that are
/// weak beside another.
pub fn choose(peaks: &mut [Peak], scene: &Scene, p: &ChooseParams) {
    let scale = scene.full_scale / 255.0;
    let upright = p.steepest_deg.to_radians().cos();
    // Lines across the stripe are image columns, or rows where the laser lies the other way.
    let columns = scene.across[1].abs() >= scene.across[0].abs();
    let line = |k: &Peak| if columns { k.pixel & 0xffff } else { k.pixel >> 16 } as usize;
    let mut strongest = vec![0f32; if columns { scene.width } else { scene.height } as usize];
    for k in peaks.iter_mut() {
        let why = alone(k, scene, p, scale, upright);
        k.refuse(why);
        if k.kept() {
            let s = &mut strongest[line(k)];
            *s = s.max(k.amplitude);
        }
    }
    let reach = (p.echo_reach * scene.width_px + 0.5).floor() as usize;
    for k in peaks.iter_mut() {
        let at = line(k);
        let last = (at + reach).min(strongest.len() - 1);
        let top = strongest[at.saturating_sub(reach)..=last].iter().fold(0f32, |a, &b| a.max(b));
        if k.amplitude < p.echo * top {
            k.refuse(Reject::Echo);
        } else if k.width_px < p.cut_width * scene.width_px && k.amplitude < p.cut_amplitude * top {
            k.refuse(Reject::Narrow);
        }
    }
}

/// The tests that need no other peak.
fn alone(k: &Peak, scene: &Scene, p: &ChooseParams, scale: f32, upright: f32) -> Reject {
    let across = k.normal_u * scene.across[0] + k.normal_v * scene.across[1];
    if k.amplitude < p.faintest * scale {
        Reject::Faint
    } else if k.width_px < p.narrowest * scene.width_px {
        Reject::Narrow
    } else if k.width_px > p.widest * scene.width_px {
        Reject::Wide
    } else if !(k.sigma_px <= p.uncertain * scene.width_px) {
        Reject::Uncertain
    } else if across.abs() < upright {
        Reject::Steep
    } else {
        Reject::Kept
    }
}
