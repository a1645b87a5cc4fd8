//! In: the peaks of one shot. Out: the same peaks; those of two surfaces at the ends of lines are marked, and those
//! alone on their line. Frame and unit: pixels of the shot; docs/math.md, Stripe peak.
//!
//! Where a surface ends and another one begins, lens and fit mix the light of both. The last peaks of a line are too
//! wide there, or lie in the glow of the other surface, and their centres lie between the two.

use super::line::{Line, near_px};
use super::params::SupportParams;
use crate::stages::peak::found::{Peak, Reject};
use glam::Vec2;

/// Marks peaks; `across` is the unit vector across the stripe, `width_px` the stripe's Gaussian sigma.
pub fn mark(peaks: &mut [Peak], across: Vec2, width_px: f32, settings: &SupportParams) {
    if !settings.on {
        return;
    }
    let line = Line::new(peaks, across);
    let near = near_px(width_px);
    // Out of focus all peaks are wide.
    let widest = settings.end_width * usual(peaks, |k| k.width_px).max(width_px);
    let level = usual(peaks, |k| k.background);
    for i in 0..line.len() {
        let [before, after] = [-1, 1].map(|step| line.beside(i, step, near).next().is_some());
        if !before && !after {
            peaks[line.peak(i)].refuse(Reject::Unsupported);
        }
        if before == after {
            continue;
        }
        let inwards = if after { 1 } else { -1 };
        for j in std::iter::once(i).chain(line.beside(i, inwards, near)) {
            let k = &mut peaks[line.peak(j)];
            if k.width_px <= widest && k.background - level <= settings.end_haze * k.amplitude {
                break;
            }
            k.refuse(Reject::Mixed);
        }
    }
}

/// Median over the kept peaks.
fn usual(peaks: &[Peak], of: fn(&Peak) -> f32) -> f32 {
    let mut all: Vec<f32> = peaks.iter().filter(|k| k.kept()).map(of).collect();
    if all.is_empty() {
        return 0.0;
    }
    let middle = all.len() / 2;
    *all.select_nth_unstable_by(middle, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    const STRIPE: f32 = 0.7;

    /// Points a pixel apart along a direction, with these widths. They scatter across it, as measured ones do.
    fn line(from: Vec2, along: Vec2, widths: &[f32]) -> Vec<Peak> {
        let peak = |(i, &width_px): (usize, &f32)| {
            let at = from + along * i as f32 + along.perp() * if i % 2 == 0 { 0.2 } else { -0.2 };
            Peak { u: at.x, v: at.y, amplitude: 100.0, background: 5.0, width_px, ..Peak::default() }
        };
        widths.iter().enumerate().map(peak).collect()
    }

    fn mixed(peaks: &[Peak]) -> Vec<usize> {
        (0..peaks.len()).filter(|&i| peaks[i].reject() == Reject::Mixed).collect()
    }

    /// Lying, upright and slanted stripes, in both orders: wide peaks go at the ends and stay in the middle.
    #[test]
    fn an_end_that_is_too_wide_goes() {
        let widths = [1.1, 1.0, 0.7, 0.7, 1.2, 0.7, 0.7, 0.7, 0.7, 0.7, 0.7, 0.9, 1.0];
        for degrees in [0.0f32, 42.0, 90.0, 135.0, 180.0] {
            let along = Vec2::from_angle(degrees.to_radians());
            let mut peaks = line(Vec2::new(300.0, 200.0), along, &widths);
            mark(&mut peaks, along.perp(), STRIPE, &SupportParams::default());
            assert_eq!(mixed(&peaks), [0, 1, 12], "{degrees} degrees");
        }
    }

    /// A background of 5 levels everywhere is room light; 4 more at an end are the glow of another surface.
    #[test]
    fn an_end_in_a_glow_goes() {
        let mut peaks = line(Vec2::ZERO, Vec2::X, &[STRIPE; 9]);
        peaks[8].background = 9.0;
        mark(&mut peaks, Vec2::Y, STRIPE, &SupportParams::default());
        assert_eq!(mixed(&peaks), [8]);
    }

    #[test]
    fn a_wide_stripe_has_longer_ends_and_gaps() {
        let widths: Vec<f32> = (0..60).map(|i| if i < 6 { 6.0 } else { 4.0 }).collect();
        let mut peaks = line(Vec2::ZERO, Vec2::X, &widths);
        // A gap that is narrower than what a fit mixes.
        peaks.drain(20..30);
        peaks[25].width_px = 6.0;
        mark(&mut peaks, Vec2::Y, 4.0, &SupportParams::default());
        assert_eq!(mixed(&peaks), [0, 1, 2, 3, 4, 5]);
    }

    /// However wide a whole piece of the line is, no point far from its end goes; out of focus none at all.
    #[test]
    fn what_is_out_of_focus_stays() {
        let mut peaks = line(Vec2::ZERO, Vec2::X, &[STRIPE; 30]);
        peaks[..10].iter_mut().for_each(|k| k.width_px = 1.1);
        mark(&mut peaks, Vec2::Y, STRIPE, &SupportParams::default());
        assert_eq!(mixed(&peaks), [0, 1, 2]);
        let mut peaks = line(Vec2::ZERO, Vec2::X, &[1.1; 30]);
        mark(&mut peaks, Vec2::Y, STRIPE, &SupportParams::default());
        assert!(peaks.iter().all(Peak::kept));
    }

    #[test]
    fn a_point_alone_on_its_line_is_not_believed() {
        let mut peaks = line(Vec2::ZERO, Vec2::X, &[STRIPE; 9]);
        // Ten pixels across the line, on another surface.
        peaks[4].v = 10.0;
        mark(&mut peaks, Vec2::Y, STRIPE, &SupportParams::default());
        let alone: Vec<usize> = (0..9).filter(|&i| !peaks[i].kept()).collect();
        assert_eq!(alone, [4]);
        assert_eq!(peaks[4].reject(), Reject::Unsupported);
    }

    /// Rejected peaks are no neighbours, and keep their reason.
    #[test]
    fn what_is_rejected_already_stays_so() {
        let mut peaks = line(Vec2::ZERO, Vec2::X, &[0.7, 0.7, 0.7, 0.7, 1.1, 0.7, 0.7]);
        peaks[5].refuse(Reject::Wide);
        peaks[6].refuse(Reject::Echo);
        mark(&mut peaks, Vec2::Y, STRIPE, &SupportParams::default());
        assert_eq!(mixed(&peaks), [4]);
        assert_eq!([peaks[5].reject(), peaks[6].reject()], [Reject::Wide, Reject::Echo]);
    }

    #[test]
    fn settings_turn_it_off() {
        let kept = SupportParams { end_width: 3.0, end_haze: 10.0, ..Default::default() };
        for settings in [SupportParams { on: false, ..Default::default() }, kept] {
            let mut peaks = line(Vec2::ZERO, Vec2::X, &[1.2, 0.7, 0.7]);
            peaks[2].background = 50.0;
            mark(&mut peaks, Vec2::Y, STRIPE, &settings);
            assert!(peaks.iter().all(Peak::kept));
        }
    }
}
