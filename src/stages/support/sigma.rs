//! In: the peaks of one shot and their points. Out: the same; their standard deviations contain what the surface itself
//! may shift: its brightness, its steps. Frame and unit: pixels of the shot, mm; docs/math.md, Stripe peak (9) to (11).

use super::line::Line;
use super::{gradient, steps};
use crate::stages::peak::found::Peak;
use crate::stages::stripe::point::Point;
use glam::Vec2;

/// Widens the standard deviations of kept peaks and of their points. `across` is the unit vector across the stripe,
/// `width_px` the stripe's Gaussian sigma.
pub fn widen(peaks: &mut [Peak], points: &mut [Point], across: Vec2, width_px: f32) {
    let line = Line::new(peaks, across);
    let [light, steps] = {
        let (light, steps) = (gradient::shifts(peaks, &line, width_px), steps::shifts(peaks, &line, width_px));
        [light.collect::<Vec<f32>>(), steps.collect()]
    };
    for (i, shift) in light.iter().zip(&steps).map(|(a, b)| a.hypot(*b)).enumerate().filter(|(_, s)| *s > 0.0) {
        let (k, p) = (&mut peaks[line.peak(i)], &mut points[line.peak(i)]);
        let stated = k.sigma_px;
        k.sigma_px = stated.hypot(shift);
        p.sigma_mm *= k.sigma_px / stated;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stages::peak::found::Reject;

    /// A surface that grows brighter, a step of 1 px in its middle, and a rejected peak among them.
    #[test]
    fn both_shifts_add_up_in_peaks_and_points_and_nothing_else_changes() {
        let off = |i: usize| [0.0, 0.5, 1.0][(i.max(9) - 9).min(2)];
        let peak = |i: usize| Peak {
            u: i as f32,
            v: off(i),
            amplitude: 80.0 * if i < 20 { 1.0 } else { (0.2 * (i as f32 - 20.0)).exp() },
            width_px: 1.0,
            sigma_px: 0.01,
            ..Peak::default()
        };
        let mut peaks: Vec<Peak> = (0..40).map(peak).collect();
        peaks[25].refuse(Reject::Wide);
        let mut points = vec![Point { position: glam::Vec3::ONE, sigma_mm: 0.004 }; 40];
        points[25] = Point::NONE;
        let (before, places) = (peaks.clone(), points.clone());
        widen(&mut peaks, &mut points, Vec2::Y, 1.0);
        // On the step half a pixel; where the light grows 0.65 px² of a sheet times 0.2 a pixel.
        for (i, shift) in [(10, 0.499f32), (30, 0.13)] {
            let want = 0.01f32.hypot(shift);
            assert!((peaks[i].sigma_px / want - 1.0).abs() < 0.01, "{i}: {} for {want}", peaks[i].sigma_px);
            assert!((points[i].sigma_mm / (0.4 * want) - 1.0).abs() < 0.01, "{i}: {}", points[i].sigma_mm);
        }
        assert!(peaks[2] == before[2] && peaks[25] == before[25] && points[25].sigma_mm.is_nan());
        assert!(points.iter().zip(&places).enumerate().all(|(i, (a, b))| i == 25 || a.position == b.position));
    }
}
