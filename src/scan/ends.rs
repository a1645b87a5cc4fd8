//! In: the peaks of one shot. Out: the same peaks; those beyond the end of a surface are marked, and those alone on
//! their line. Frame and unit: pixels of the shot; docs/math.md, Stripe peak.
//!
//! Lens and fit mix the light of neighbouring places. So a line goes on beyond the end of its surface, with less and
//! less light. Where another surface begins, the line is too wide: two lights are one peak there. The centres of both
//! are wrong.

use crate::stages::peak::found::{Peak, Reject};
use crate::stages::support::params::SupportParams;
use glam::Vec2;

/// Distance over which a fit mixes light, in the stripe's sigmas. Points of a line are neighbours up to it, and none
/// farther from a line's end is rejected.
const NEAR: f32 = 3.5;
/// Least such distance, px: thinning leaves gaps of a pixel.
const NEAR_PX: f32 = 2.5;
/// A line goes on beyond its surface by at most this many of the stripe's sigmas.
const BEYOND: f32 = 1.5;

/// A kept peak.
#[derive(Clone, Copy)]
struct Site {
    /// Position along the stripe and across it, px.
    at: Vec2,
    light: f32,
    width_px: f32,
    /// Its index.
    peak: usize,
}

/// Marks peaks; `across` is the unit vector across the stripe, `width_px` the stripe's Gaussian sigma.
pub(super) fn mark(peaks: &mut [Peak], across: Vec2, width_px: f32, settings: &SupportParams) {
    if !settings.on || settings.end <= 0.0 {
        return;
    }
    let along = across.perp();
    let site = |(peak, k): (usize, &Peak)| {
        let at = Vec2::new(k.u, k.v);
        let at = Vec2::new(at.dot(along), at.dot(across));
        Site { at, light: k.amplitude, width_px: k.width_px, peak }
    };
    let mut sites: Vec<Site> = peaks.iter().enumerate().filter(|(_, k)| k.kept()).map(site).collect();
    sites.sort_by(|a, b| a.at.x.total_cmp(&b.at.x));
    let near = (NEAR * width_px).max(NEAR_PX);
    let widest = settings.right_width[1] * usual_width(&sites).max(width_px);
    for i in 0..sites.len() {
        let [before, after] = [-1, 1].map(|step| beside(&sites, i, step, near).next().is_some());
        if !before && !after {
            peaks[sites[i].peak].refuse(Reject::Unsupported);
        }
        if before == after {
            continue;
        }
        let inwards = if after { 1 } else { -1 };
        for j in std::iter::once(i).chain(beside(&sites, i, inwards, near)) {
            let site = &sites[j];
            let inside = beside(&sites, j, inwards, near).map(|k| sites[k].light).fold(0.0, f32::max);
            let beyond = site.at.distance(sites[i].at) <= BEYOND * width_px && site.light < settings.end * inside;
            if !beyond && site.width_px <= widest {
                break;
            }
            peaks[site.peak].refuse(Reject::Beyond);
        }
    }
}

/// Median width of the peaks. Out of focus it exceeds the stripe's.
fn usual_width(sites: &[Site]) -> f32 {
    let mut widths: Vec<f32> = sites.iter().map(|s| s.width_px).collect();
    let middle = widths.len() / 2;
    widths.sort_unstable_by(f32::total_cmp);
    widths.get(middle).copied().unwrap_or(0.0)
}

/// Neighbours of a site up to this distance, on the side where the order goes on by `step`.
fn beside(sites: &[Site], i: usize, step: isize, near: f32) -> impl Iterator<Item = usize> + '_ {
    let here = sites[i].at;
    std::iter::successors(i.checked_add_signed(step), move |j| j.checked_add_signed(step))
        .take_while(move |&j| sites.get(j).is_some_and(|s| (s.at.x - here.x).abs() <= near))
        .filter(move |&j| sites[j].at.distance(here) <= near)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points a pixel apart along a direction, with this light.
    fn line(from: Vec2, along: Vec2, lights: &[f32]) -> Vec<Peak> {
        let peak = |(i, &amplitude): (usize, &f32)| {
            let at = from + along * i as f32;
            Peak { u: at.x, v: at.y, amplitude, width_px: 0.7, ..Peak::default() }
        };
        lights.iter().enumerate().map(peak).collect()
    }

    fn reasons(peaks: &[Peak]) -> Vec<Reject> {
        peaks.iter().map(Peak::reject).collect()
    }

    /// Lying, upright and slanted stripes, in both orders.
    #[test]
    fn a_line_goes_on_beyond_its_surface_with_little_light() {
        let lights = [20.0, 55.0, 100.0, 100.0, 30.0, 100.0, 90.0, 100.0, 49.0];
        let expected: Vec<Reject> =
            (0..9).map(|i| if i == 0 || i == 8 { Reject::Beyond } else { Reject::Kept }).collect();
        for degrees in [0.0f32, 42.0, 90.0, 135.0, 180.0] {
            let along = Vec2::from_angle(degrees.to_radians());
            let mut peaks = line(Vec2::new(300.0, 200.0), along, &lights);
            mark(&mut peaks, along.perp(), 0.7, &SupportParams::default());
            assert_eq!(reasons(&peaks), expected, "{degrees} degrees");
        }
    }

    /// With a wide stripe several points lie beyond the end, and neighbours farther apart.
    #[test]
    fn a_wide_stripe_goes_on_farther() {
        let lights: Vec<f32> = (0..40).map(|i| 100.0 * (0.1 * i as f32).min(1.0)).collect();
        let mut peaks = line(Vec2::ZERO, Vec2::X, &lights);
        // A gap of thinning, narrower than what a fit mixes.
        peaks.drain(20..30);
        mark(&mut peaks, Vec2::Y, 4.0, &SupportParams::default());
        let beyond = peaks.iter().take_while(|k| k.reject() == Reject::Beyond).count();
        assert_eq!(beyond, 5, "{:?}", reasons(&peaks));
        assert!(peaks[beyond..].iter().all(Peak::kept));
    }

    #[test]
    fn a_point_alone_on_its_line_is_not_believed() {
        let mut peaks = line(Vec2::ZERO, Vec2::X, &[100.0; 9]);
        // Ten pixels across the line, on another surface.
        peaks[4].v = 10.0;
        mark(&mut peaks, Vec2::Y, 0.7, &SupportParams::default());
        let alone: Vec<usize> = (0..9).filter(|&i| !peaks[i].kept()).collect();
        assert_eq!(alone, [4]);
        assert_eq!(peaks[4].reject(), Reject::Unsupported);
    }

    /// Two surfaces in one peak, at an end. In the middle of a line such peaks stay, and out of focus all do.
    #[test]
    fn an_end_that_is_too_wide_goes() {
        let mut peaks = line(Vec2::ZERO, Vec2::X, &[100.0; 12]);
        for i in [0, 1, 5, 11] {
            peaks[i].width_px = 0.9;
        }
        mark(&mut peaks, Vec2::Y, 0.7, &SupportParams::default());
        let beyond: Vec<usize> = (0..12).filter(|&i| peaks[i].reject() == Reject::Beyond).collect();
        assert_eq!(beyond, [0, 1, 11]);
        let mut peaks = line(Vec2::ZERO, Vec2::X, &[100.0; 12]);
        peaks.iter_mut().for_each(|k| k.width_px = 1.1);
        mark(&mut peaks, Vec2::Y, 0.7, &SupportParams::default());
        assert!(peaks.iter().all(Peak::kept));
    }

    /// However wide a whole piece of the line is, no point far from its end goes.
    #[test]
    fn a_piece_out_of_focus_stays() {
        let mut peaks = line(Vec2::ZERO, Vec2::X, &[100.0; 30]);
        peaks[..10].iter_mut().for_each(|k| k.width_px = 1.0);
        mark(&mut peaks, Vec2::Y, 0.7, &SupportParams::default());
        assert!(peaks[3..].iter().all(Peak::kept), "{:?}", reasons(&peaks));
    }

    /// Rejected peaks are no neighbours, and keep their reason.
    #[test]
    fn what_is_rejected_already_stays_so() {
        let mut peaks = line(Vec2::ZERO, Vec2::X, &[100.0, 100.0, 10.0, 100.0, 100.0]);
        peaks[3].refuse(Reject::Wide);
        peaks[4].refuse(Reject::Echo);
        mark(&mut peaks, Vec2::Y, 0.7, &SupportParams::default());
        assert_eq!(reasons(&peaks), [Reject::Kept, Reject::Kept, Reject::Beyond, Reject::Wide, Reject::Echo]);
    }

    #[test]
    fn settings_turn_it_off() {
        for settings in
            [SupportParams { on: false, ..Default::default() }, SupportParams { end: 0.0, ..Default::default() }]
        {
            let mut peaks = line(Vec2::ZERO, Vec2::X, &[10.0, 100.0, 100.0]);
            mark(&mut peaks, Vec2::Y, 0.7, &settings);
            assert!(peaks.iter().all(Peak::kept));
        }
    }
}
