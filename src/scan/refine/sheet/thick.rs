//! In: a scan's lines with what their neighbours show. Out: the sheet's thickness as the cloud shows it, and the
//! points without its effect where brightness changes.
//! Frame and unit: the cloud's frame, mm; docs/math.md, Sheets that are thick.

use super::super::slope::slope;
use super::lines::{Beside, FARTHEST, Pull, Pulled, lines};
use super::reflectance::{FARTHEST as TOLD, Light, Shift, shift};
use crate::fault::Result;
use crate::scan::{CloudPoint, PointSource, Shots};
use crate::solve::robust_scale;
use rayon::prelude::*;
use std::collections::VecDeque;

/// A point is compared with its neighbours if it lies between them, at least this share of their distance from each.
const BETWEEN: f64 = 0.2;
/// The neighbours' depths must differ by less than this share of their distance: a comparison across an edge is
/// useless.
const LEVEL: f64 = 0.6;
/// Residuals beyond this many robust deviations are edges.
const EDGE: f64 = 10.0;
/// Least and largest relative standard deviation of a light by speckle and noise. On a mostly printed surface the
/// lights' usual scatter is the print itself.
const SPECKLE: [f64; 2] = [0.03, 0.12];
/// Part of that deviation that does not depend on the light, relative to the point's own light.
const FLOOR: f64 = 0.04;
/// Lights that differ from the point's own by less than this many deviations of the difference show no change.
const UNCHANGED: f64 = 1.5;
/// A light of less than this, relative to the point's own, shows nothing.
const DARK: f64 = 0.2;
/// Thicknesses among which the most likely one is searched, in widths of the stripe on the surface: the first, the
/// ratio from one to the next, their number.
const THINNEST: f64 = 0.15;
const RATIO: f64 = 1.25;
const TRIED: i32 = 11;
/// Comparisons that the search uses.
const SAMPLE: usize = 1 << 11;
/// An expected distance counts as one from this many of its stated standard deviations on.
const EXPECTED: f64 = 0.5;
/// With fewer comparisons nothing is concluded.
const FEWEST: usize = 256;
/// Above this number comparisons are thinned out.
const MOST: usize = 1 << 14;
const ROUNDS: usize = 5;

/// Effect of the sheet's thickness where brightness changes; in scan.json.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SheetFound {
    /// Standard deviation of the light across the sheet, as its effect shows it, mm. It is within 0.7 and 1.6 of the
    /// real one, and less if shots lie farther apart than three of those.
    pub thickness_mm: f64,
    /// Standard deviation of that.
    pub thickness_sigma_mm: f64,
    /// Standard deviation that the points keep where brightness changes, mm: root mean square over the moved points.
    /// It is included in the points' sigma.
    pub scatter_mm: f64,
    /// Share of the points that were moved by more than their standard deviation.
    pub moved: f64,
}

impl std::fmt::Display for SheetFound {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let SheetFound { thickness_mm, thickness_sigma_mm, scatter_mm, moved } = self;
        write!(
            f,
            "Changes of brightness shift points like a laser sheet of {thickness_mm:.3} +- {thickness_sigma_mm:.3} mm \
             (1 sigma). "
        )?;
        write!(f, "This shift was removed; for {:.1} % of the points it exceeded their sigma. ", 100.0 * moved)?;
        write!(f, "These points keep a standard deviation of {scatter_mm:.3} mm, which their sigma contains.")
    }
}

/// What a cloud shows about its sheet.
#[derive(Clone, Copy, Debug)]
pub struct Thick {
    bell: Bell,
    /// Standard deviation of the sheet's thickness, mm.
    sigma_mm: f64,
    /// Factor of the shifts' stated standard deviations that the points' scatter shows; at least 1.
    left: f64,
}

/// What the shifts are computed with.
#[derive(Clone, Copy, Debug)]
struct Bell {
    /// Standard deviation of the sheet, mm.
    mm: f64,
    /// Relative standard deviation of a light.
    speckle: f64,
}

/// One of three points that are compared.
#[derive(Clone)]
struct Part {
    pull: Pull,
    /// Shift of the comparison along the ray for a shift of the point's light by 1 mm.
    by: f64,
}

/// A point between its two neighbours.
#[derive(Clone)]
struct Between {
    /// Its distance beyond them along its ray, mm, and the stated variance of that distance from all three.
    beyond: f64,
    stated: f64,
    /// The point itself and the two neighbours.
    parts: [Part; 3],
    /// Width of the stripe, mm.
    width_mm: f64,
}

impl Bell {
    /// Shift of the middle of a point's light, mm.
    fn shift(self, pull: &Pull) -> Shift {
        let light =
            |&Beside { at, light }: &Beside| Light { at: at / self.mm, light, sigma: self.speckle * light + FLOOR };
        // Farther away nothing is told of the reflectance here: between the two it may change anywhere.
        let lights: Vec<Light> = pull.lights.iter().map(light).filter(|l| l.at.abs() <= TOLD).collect();
        let apart = |l: &Light| (l.light - 1.0).abs() / (self.speckle * l.light.max(1.0) * 2f64.sqrt() + FLOOR);
        let changed = (lights.iter().map(apart).fold(0.0, f64::max) - UNCHANGED).clamp(0.0, 1.0);
        if changed <= 0.0 {
            return Shift::default();
        }
        let Shift { by, sigma } = shift(&lights);
        let size = changed * self.mm;
        Shift { by: by * size, sigma: sigma * size }
    }

    /// Shift of a comparison, mm, and the variance of that.
    fn shifts(self, between: &Between) -> (f64, f64) {
        let each = between.parts.iter().map(|part| {
            let Shift { by, sigma } = self.shift(&part.pull);
            (by * part.by, (sigma * part.by).powi(2))
        });
        each.fold((0.0, 0.0), |(by, variance), one| (by + one.0, variance + one.1))
    }

    /// Expected and observed distances of the comparisons, and the variances of the expected ones.
    fn pairs(self, all: &[Between]) -> (Vec<[f64; 2]>, Vec<f64>) {
        let shifts: Vec<(f64, f64)> = all.par_iter().with_min_len(64).map(|b| self.shifts(b)).collect();
        (shifts.iter().zip(all).map(|(s, b)| [-s.0, b.beyond]).collect(), shifts.iter().map(|s| s.1).collect())
    }

    /// Negative logarithm of the comparisons' likelihood, but for a constant. Residuals have Cauchy's distribution,
    /// whose wings bear those of edges.
    fn unlikely(self, all: &[Between]) -> f64 {
        let pairs = self.pairs(all).0;
        all.iter().zip(&pairs).map(|(b, [expected, seen])| ((seen - expected).powi(2) / b.stated).ln_1p()).sum()
    }

    /// The most likely thickness, for stripes of this width on the surface, mm.
    fn searched(self, all: &[Between], width_mm: f64) -> Bell {
        let bell = |k: f64| Bell { mm: THINNEST * width_mm * RATIO.powf(k), ..self };
        let unlikely: Vec<f64> = (0..TRIED).map(|k| bell(f64::from(k)).unlikely(all)).collect();
        let best = (0..unlikely.len()).min_by(|a, b| unlikely[*a].total_cmp(&unlikely[*b])).unwrap_or(0);
        // The vertex of the parabola through the best and the two beside it.
        let vertex = match unlikely.get(best.wrapping_sub(1)..best.saturating_add(2)) {
            Some([a, b, c]) if a + c > 2.0 * b => 0.5 * (a - c) / (a + c - 2.0 * b),
            _ => 0.0,
        };
        bell(best as f64 + vertex)
    }
}

impl Thick {
    /// Examines a cloud in the order of its shots. `None` if the sheet is not recorded, or if the cloud does not
    /// show that brightness shifts its points.
    pub fn of(cloud: &dyn PointSource, shots: &Shots) -> Result<Option<Thick>> {
        let (mut all, mut every, mut seen) = (Vec::new(), 1, 0_usize);
        let mut near: VecDeque<Pulled> = VecDeque::new();
        lines(cloud, shots, &mut |line| {
            near.push_back(line);
            let known = near.make_contiguous();
            let Some(after) = known.last() else { return Ok(()) };
            for line in known.iter().filter(|line| line.line.shot + line.stride == after.line.shot) {
                let Some(before) = known.iter().find(|b| b.line.shot + line.stride == line.line.shot) else {
                    continue;
                };
                for i in 0..line.pulls.len() {
                    seen += 1;
                    if seen.is_multiple_of(every) {
                        all.extend(between(before, line, i, after));
                    }
                    if all.len() >= MOST {
                        let mut k = 0;
                        all.retain(|_| (k += 1, k % 2 == 1).1);
                        every *= 2;
                    }
                }
            }
            if near.len() > 2 * FARTHEST {
                near.pop_front();
            }
            Ok(())
        })?;
        if all.len() < FEWEST {
            return Ok(None);
        }
        // The mean of two lights differs from the one between them by the root of 1.5 deviations.
        let mut dips: Vec<f64> = all.iter().filter_map(|b| dip(&b.parts[0].pull)).map(f64::abs).collect();
        let speckle = (robust_scale(&mut dips, 1) / 1.5f64.sqrt()).clamp(SPECKLE[0], SPECKLE[1]);
        let sample: Vec<Between> = all.iter().step_by(all.len().div_ceil(SAMPLE)).cloned().collect();
        let mut widths: Vec<f64> = sample.iter().map(|b| b.width_mm).collect();
        widths.sort_by(f64::total_cmp);
        let width = widths[widths.len() / 2];
        let bell = Bell { mm: 0.0, speckle }.searched(&sample, width);
        let (pairs, unsure) = bell.pairs(&all);
        let expected = pairs.iter().zip(&all).filter(|(p, b)| p[0].abs() > EXPECTED * b.stated.sqrt()).count();
        let Some(size) = slope(&pairs).filter(|size| size.sure() && expected >= FEWEST) else { return Ok(None) };
        let rest = |((b, [expected, seen]), unsure): ((&Between, &[f64; 2]), &f64)| {
            [*unsure, seen - size.is * expected, b.stated]
        };
        let rests: Vec<[f64; 3]> = all.iter().zip(&pairs).zip(&unsure).map(rest).collect();
        Ok(Some(Thick { bell, sigma_mm: 0.5 * bell.mm * size.sigma / size.is, left: left(&rests) }))
    }

    /// Passes the corrected points to `take`, line by line in their order.
    pub fn apply(
        &self,
        cloud: &dyn PointSource,
        shots: &Shots,
        take: &mut dyn FnMut(&[CloudPoint]) -> Result<()>,
    ) -> Result<SheetFound> {
        let (mut moved, mut all, mut scattered) = (0_u64, 0_u64, 0.0);
        let mut points: Vec<CloudPoint> = Vec::new();
        lines(cloud, shots, &mut |Pulled { line, pulls, .. }| {
            let shifts: Vec<Shift> = pulls.par_iter().with_min_len(64).map(|pull| self.bell.shift(pull)).collect();
            points.clear();
            for ((p, Pull { per, .. }), Shift { by, sigma }) in line.points.iter().zip(&pulls).zip(shifts) {
                let by = per * by;
                let scatter = per.norm() * sigma * self.left;
                if by.norm() as f32 > p.sigma_mm {
                    moved += 1;
                    scattered += scatter * scatter;
                }
                let moved_to = p.moved_to(p.at() + by);
                points.push(CloudPoint { sigma_mm: p.sigma_mm.hypot(scatter as f32), ..moved_to });
            }
            all += points.len() as u64;
            take(&points)
        })?;
        Ok(SheetFound {
            thickness_mm: self.bell.mm,
            thickness_sigma_mm: self.sigma_mm,
            scatter_mm: (scattered / moved.max(1) as f64).sqrt(),
            moved: moved as f64 / all.max(1) as f64,
        })
    }
}

/// How much brighter the two sheets beside a point are than its own, as a logarithm; `None` where one of them shows
/// nothing. The point's own sheet is the one nearest to it.
fn dip(pull: &Pull) -> Option<f64> {
    let lights = &pull.lights;
    let own = (0..lights.len()).min_by(|a, b| lights[*a].at.abs().total_cmp(&lights[*b].at.abs()))?;
    let (before, after) = (lights.get(own.checked_sub(1)?)?, lights.get(own + 1)?);
    (before.light.min(after.light) > DARK).then(|| 0.5 * (before.light.ln() + after.light.ln()))
}

/// Factor of the shifts' standard deviations that the points' scatter shows. Each entry is (variance of the shifts,
/// residual, its stated variance). The stated variance is scaled to the residuals' usual size; the slope of the
/// squared residuals beyond it is fitted by weighted least squares. The result is at least 1.
fn left(rests: &[[f64; 3]]) -> f64 {
    let mut over: Vec<f64> = rests.iter().map(|[_, rest, stated]| rest.abs() / stated.sqrt()).collect();
    let usual = robust_scale(&mut over, 1).powi(2);
    let noisy = rests.iter().map(|[unsure, rest, stated]| (*unsure, rest * rest, usual * stated));
    let near: Vec<(f64, f64, f64)> = noisy.filter(|(_, rest, noise)| *rest < EDGE * EDGE * noise).collect();
    let mut grows = 1.0_f64;
    for _ in 0..ROUNDS {
        let (mut all, mut across) = (0.0, 0.0);
        for &(unsure, rest, noise) in &near {
            let weight = (noise + grows * unsure).powi(-2) * unsure;
            all += weight * unsure;
            across += weight * (rest - noise);
        }
        if all <= 0.0 {
            return 1.0;
        }
        grows = (across / all).max(1.0);
    }
    grows.sqrt()
}

/// The `i`-th point of a line between its neighbours; `None` if it lacks one, or lies at an edge.
fn between(before: &Pulled, line: &Pulled, i: usize, after: &Pulled) -> Option<Between> {
    let (p, pull) = (&line.line.points[i], &line.pulls[i]);
    let (j, k) = (before.line.nearest(p)?, after.line.nearest(p)?);
    let (a, b) = (before.line.points[j].at(), after.line.points[k].at());
    let ray = pull.per.try_normalize(1e-12)?;
    let (chord, to) = (b - a, p.at() - a);
    let deeper = chord.dot(&ray);
    let way = chord - ray * deeper;
    let far = way.norm();
    if far <= 0.0 || deeper.abs() > LEVEL * far {
        return None;
    }
    let share = to.dot(&way) / (far * far);
    if !(BETWEEN..=1.0 - BETWEEN).contains(&share) {
        return None;
    }
    let part = |line: &Pulled, i: usize, part: f64| {
        let pull = line.pulls[i].clone();
        Part { by: part * pull.per.dot(&ray), pull }
    };
    let width_mm = line.line.width_mm()?;
    let stated = |p: &CloudPoint, part: f64| (f64::from(p.sigma_mm) * part).powi(2);
    let stated = stated(p, 1.0) + stated(&before.line.points[j], 1.0 - share) + stated(&after.line.points[k], share);
    // A fit that its light does not determine states any size, even infinite or NaN.
    stated.is_normal().then_some(Between {
        beyond: to.dot(&ray) - share * deeper,
        stated,
        parts: [part(line, i, 1.0), part(before, j, share - 1.0), part(after, k, -share)],
        width_mm,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Base, Camera, Plane, Rigid, Vec3, exp};
    use crate::scan::Along;
    use crate::stages::noise::Noise;

    /// A scan by a camera 150 mm above a surface, with a sheet 60 mm beside it.
    #[derive(Clone, Copy)]
    struct Scene {
        shots: u32,
        along: Along,
        /// Distance from shot to shot, mm, and rotation of camera and sheet about the vertical, rad.
        step: f64,
        turn: f64,
        /// Standard deviation of the sheet, mm.
        thick: f64,
        height: fn(f64, f64) -> f64,
        albedo: fn(f64, f64) -> f64,
        /// Scatter of the light from point to point, and of the laser from shot to shot, as logarithms.
        speckle: f64,
        flicker: f64,
        focal_px: f64,
        /// Scatter of the points along the vertical, mm.
        noise_mm: f64,
    }

    /// Printed lines 1.6 mm wide with gaps as wide, edges 0.15 mm wide, four times as bright as the ground.
    fn print(x: f64, y: f64) -> f64 {
        let wave = (y / 1.6 * std::f64::consts::PI + 0.3 * x).sin();
        0.25 + 0.75 / (1.0 + (-wave * 1.6 / std::f64::consts::PI / 0.05).exp())
    }

    const PRINTED: Scene = Scene {
        shots: 60,
        along: Along::U,
        step: 0.25,
        turn: 0.0,
        thick: 0.1,
        height: |x, y| 0.05 * x + 0.1 * y,
        albedo: print,
        speckle: 0.03,
        flicker: 0.0,
        focal_px: 600.0,
        noise_mm: 0.01,
    };

    fn sheet() -> Plane<Camera> {
        Plane::new(Vec3::new(0.0, 150.0, 60.0), 9000.0).unwrap()
    }

    impl Scene {
        /// The light on the surface is a Gaussian about the sheet's middle times the surface's albedo. A point lies
        /// where the sheet's middle meets the ray of that light's centre.
        fn scan(&self, seed: u64) -> (Vec<CloudPoint>, Shots) {
            let mut noise = Noise(seed);
            let (mut cloud, mut places) = (Vec::new(), Vec::new());
            for shot in 0..self.shots {
                let k = f64::from(shot);
                let turned = exp(&(Vec3::z() * (self.turn * k))) * exp(&(Vec3::x() * std::f64::consts::PI));
                let place: Rigid<Base, Camera> = Rigid::new(turned, Vec3::new(0.0, self.step * k, 150.0));
                let laser = (self.flicker * noise.normal()).exp();
                for column in 0..200 {
                    let x = (f64::from(column) - 100.0) * 150.0 / self.focal_px;
                    let seen = |y: f64| {
                        let on = place.point(&Vec3::new(x, y, 150.0));
                        let on = Vec3::new(on.x, on.y, (self.height)(on.x, on.y));
                        (on, place.inverse().point(&on))
                    };
                    let middle = (0..20).fold(0.0, |y, _| y - sheet().distance(&seen(y).1));
                    let (mut light, mut ray) = (0.0, Vec3::zeros());
                    for part in -60..=60 {
                        let (on, seen) = seen(middle + f64::from(part) * 0.1 * self.thick);
                        let off = sheet().distance(&seen) / self.thick;
                        let here = (-0.5 * off * off).exp() * (self.albedo)(on.x, on.y);
                        light += here;
                        ray += here * seen / seen.z;
                    }
                    let ray = ray / light;
                    let depth = sheet().offset / sheet().normal.dot(&ray);
                    let at = place.point(&(ray * depth)) + Vec3::z() * (self.noise_mm * noise.normal());
                    let (u, v) = (column as f32, 200.0 + (self.focal_px * ray.y) as f32);
                    let (u, v) = if self.along == Along::U { (u, v) } else { (v, u) };
                    let intensity = (8.0 * laser * light * (self.speckle * noise.normal()).exp()) as f32;
                    let position = glam::DVec3::from_array(at.into()).as_vec3();
                    cloud.push(CloudPoint {
                        position,
                        intensity,
                        sigma_mm: self.noise_mm as f32,
                        shot,
                        u,
                        v,
                        ..Default::default()
                    });
                }
                places.push((shot, place));
            }
            let stripe_px = self.focal_px * self.thick / 150.0;
            let mut shots = Shots::new(self.along, places).with_stripe(Some(stripe_px as f32));
            shots.sheet = Some(sheet());
            (cloud, shots)
        }

        fn rms(&self, cloud: &[CloudPoint]) -> f64 {
            let off = |p: &CloudPoint| {
                let [x, y, z] = p.position.as_dvec3().to_array();
                (z - (self.height)(x, y)).powi(2)
            };
            (cloud.iter().map(off).sum::<f64>() / cloud.len() as f64).sqrt()
        }

        /// The result, and the points' rms distance from the surface before and after.
        fn refined(&self, seed: u64) -> (Option<SheetFound>, f64, f64) {
            let (cloud, shots) = self.scan(seed);
            let before = self.rms(&cloud);
            let Some(thick) = Thick::of(&cloud, &shots).unwrap() else { return (None, before, before) };
            let mut after = Vec::new();
            let found = thick.apply(&cloud, &shots, &mut |points| {
                after.extend_from_slice(points);
                Ok(())
            });
            assert_eq!(after.len(), cloud.len());
            (Some(found.unwrap()), before, self.rms(&after))
        }
    }

    /// Lying and upright stripes, forwards and back, straight and turning, with shots 1 to 4 standard deviations of
    /// the sheet apart.
    #[test]
    fn print_no_longer_pulls_the_points_about() {
        for (name, scene) in [
            ("as it is", PRINTED),
            ("upright", Scene { along: Along::V, ..PRINTED }),
            ("back", Scene { step: -0.25, ..PRINTED }),
            ("turning", Scene { turn: 0.004, ..PRINTED }),
            ("fine", Scene { step: 0.1, shots: 150, ..PRINTED }),
            ("coarse", Scene { step: 0.35, ..PRINTED }),
            ("thick", Scene { thick: 0.2, ..PRINTED }),
            ("thin", Scene { thick: 0.06, ..PRINTED }),
            ("flickering", Scene { flicker: 0.03, ..PRINTED }),
            ("speckled", Scene { speckle: 0.2, ..PRINTED }),
            ("fine pixels, steep", Scene { height: |x, y| 0.3 * x - 0.5 * y, focal_px: 12_000.0, ..PRINTED }),
            ("fine pixels", Scene { focal_px: 12_000.0, ..PRINTED }),
            ("steep", Scene { height: |x, y| 0.3 * x - 0.5 * y, ..PRINTED }),
            ("round", Scene { height: |x, y| 0.02 * x * x - 0.01 * (y - 7.0).powi(2), ..PRINTED }),
        ] {
            let (found, before, after) = scene.refined(7);
            let found = found.unwrap_or_else(|| panic!("{name}: nothing is found"));
            println!("{name}: {found}; {before:.4} -> {after:.4} mm");
            // Noise alone is 0.01 mm.
            assert!(after < 0.7 * before, "{name}: {before} -> {after}");
            let ratio = found.thickness_mm / scene.thick;
            assert!((0.7..1.6).contains(&ratio), "{name}: {found:?}");
        }
    }

    /// The intersection of the sheet's middle with the ray can be restored.
    #[test]
    fn points_go_back_onto_the_sheet() {
        let (cloud, shots) = PRINTED.scan(5);
        let thick = Thick::of(&cloud, &shots).unwrap().unwrap();
        let mut after = Vec::new();
        let taken = thick.apply(&cloud, &shots, &mut |points| {
            after.extend_from_slice(points);
            Ok(())
        });
        taken.unwrap();
        // Noise along the vertical has moved the points off the sheet.
        let mut before = cloud.clone();
        shots.onto_sheet(&mut before);
        let apart = |a: &[CloudPoint], b: &[CloudPoint]| {
            a.iter().zip(b).map(|(a, b)| a.position.distance(b.position)).fold(0.0, f32::max)
        };
        let moved = apart(&before, &after);
        shots.onto_sheet(&mut after);
        println!("{moved} mm apart, {} back on the sheet", apart(&before, &after));
        assert!(moved > 0.05 && apart(&before, &after) < 1e-4);
    }

    /// The remaining error of a corrected point is in its standard deviation.
    #[test]
    fn points_that_were_moved_state_it() {
        let (mut cloud, shots) = PRINTED.scan(3);
        // One point that is not determined, and an exact one.
        for (p, sigma_mm) in cloud[5000..].iter_mut().zip([f32::INFINITY, 0.0]) {
            p.sigma_mm = sigma_mm;
        }
        let thick = Thick::of(&cloud, &shots).unwrap().unwrap();
        let mut after = Vec::new();
        let found = thick.apply(&cloud, &shots, &mut |points| {
            after.extend_from_slice(points);
            Ok(())
        });
        let beyond = |cloud: &[CloudPoint]| {
            let off = |p: &&CloudPoint| {
                let [x, y, z] = p.position.as_dvec3().to_array();
                (z - (PRINTED.height)(x, y)).abs() > 3.0 * f64::from(p.sigma_mm)
            };
            cloud.iter().filter(off).count() as f64 / cloud.len() as f64
        };
        let (before, after) = (beyond(&cloud), beyond(&after));
        println!("beyond three standard deviations: {before:.4} -> {after:.4}");
        assert!(before > 0.2 && after < 0.02, "{before} -> {after}");
        let SheetFound { moved, scatter_mm, .. } = found.unwrap();
        assert!((0.2..0.7).contains(&moved) && (0.005..0.03).contains(&scatter_mm), "{moved}, {scatter_mm}");
    }

    /// Without an effect nothing is moved: uniform brightness, speckle, a flickering laser, a thin sheet, bright
    /// ridges, few shots, shots with unknown poses.
    #[test]
    fn what_is_not_pulled_is_not_moved() {
        let even = Scene { albedo: |_, _| 1.0, ..PRINTED };
        // With a thin sheet the intensity follows the surface's brightness without shifting any point.
        let thin = Scene { thick: 0.005, ..PRINTED };
        // 0.3 mm high, in the shape of the print.
        let ridges = Scene { height: |x, y| 0.4 * print(x, y), ..thin };
        for (name, scene) in [
            ("even", even),
            ("speckled", Scene { speckle: 0.3, ..even }),
            ("flickering", Scene { flicker: 0.2, ..even }),
            ("thin", thin),
            ("ridges", ridges),
            ("few", Scene { shots: 3, ..PRINTED }),
        ] {
            for seed in 0..5 {
                let (found, before, after) = scene.refined(seed);
                println!("{name}: {found:?}: {before:.4} -> {after:.4}");
                assert!(found.is_none() && before == after, "{name}: {found:?}: {before} -> {after}");
            }
        }
        let (cloud, shots) = PRINTED.scan(1);
        assert!(Thick::of(&cloud, &Shots::unplaced(shots.along)).unwrap().is_none());
        assert!(Thick::of(&Vec::new(), &shots).unwrap().is_none());
    }

    /// Widths of the chart's bars, mm, each in a field of 10 mm.
    const BARS: [f64; 5] = [0.2, 0.5, 1.0, 2.0, 3.0];

    fn field(x: f64) -> usize {
        ((x + 25.0) / 10.0).clamp(0.0, 4.0) as usize
    }

    /// Bars turned by so many degrees, with gaps as wide and a quarter as bright.
    fn chart<const DEGREES: i32>(x: f64, y: f64) -> f64 {
        let (sin, cos) = f64::from(DEGREES).to_radians().sin_cos();
        if (x * sin + y * cos).rem_euclid(2.0 * BARS[field(x)]) < BARS[field(x)] { 1.0 } else { 0.25 }
    }

    /// Shifts by the rule of this program's earlier versions: the slope of the logarithm of the light between the
    /// shots before and after, for the true sheet.
    fn by_slope(cloud: &[CloudPoint], shots: &Shots, thick: f64) -> Vec<CloudPoint> {
        let mut out = Vec::new();
        lines(&cloud.to_vec(), shots, &mut |Pulled { line, pulls, .. }| {
            for (p, Pull { lights, per }) in line.points.iter().zip(&pulls) {
                let own = lights.iter().position(|l| l.at.abs() < 1e-3).filter(|i| (1..lights.len() - 1).contains(i));
                let by = own.map_or(0.0, |i| {
                    let (a, b) = (lights[i - 1], lights[i + 1]);
                    thick * thick * (b.light.max(1e-3) / a.light.max(1e-3)).ln() / (b.at - a.at)
                });
                out.push(p.moved_to(p.at() + per * by));
            }
            Ok(())
        })
        .unwrap();
        out
    }

    /// What remains of the pull of print, at eleven angles and four steps. The points within 1 mm of a field's rim do
    /// not count.
    #[test]
    fn a_chart_of_bars_pulls_less_than_before() {
        let charts: [fn(f64, f64) -> f64; 11] = [
            chart::<0>,
            chart::<8>,
            chart::<16>,
            chart::<24>,
            chart::<32>,
            chart::<40>,
            chart::<48>,
            chart::<56>,
            chart::<64>,
            chart::<72>,
            chart::<80>,
        ];
        let mut faults = Vec::new();
        println!("root mean square of the points' distance from the plate, um: as measured, by the slope, now");
        for (step, most) in [(0.25, 0.65), (1.0, 0.78), (2.6, 0.68), (5.0, 0.83)] {
            let scans: Vec<[Vec<CloudPoint>; 3]> = charts
                .par_iter()
                .map(|&albedo| {
                    let step = step * PRINTED.thick;
                    let shots = (8.0 / step) as u32;
                    let noise_mm = 0.001;
                    let scene = Scene { step, shots, albedo, noise_mm, height: |_, _| 0.0, ..PRINTED };
                    let (cloud, places) = scene.scan(3);
                    let slope = by_slope(&cloud, &places, PRINTED.thick);
                    let mut now = Vec::new();
                    match Thick::of(&cloud, &places).unwrap() {
                        None => now.clone_from(&cloud),
                        Some(thick) => {
                            let take = &mut |points: &[CloudPoint]| {
                                now.extend_from_slice(points);
                                Ok(())
                            };
                            thick.apply(&cloud, &places, take).unwrap();
                        }
                    }
                    [cloud, slope, now]
                })
                .collect();
            let rms = |kind: usize, least_mm: f64, most_mm: f64| {
                let inner = |p: &&CloudPoint| {
                    let x = f64::from(p.position.x) + 25.0;
                    let bars = BARS[field(x - 25.0)];
                    (1.0..9.0).contains(&x.rem_euclid(10.0)) && (least_mm..=most_mm).contains(&bars)
                };
                let all: Vec<f64> = scans
                    .iter()
                    .flat_map(|s| s[kind].iter().filter(inner).map(|p| f64::from(p.position.z).powi(2)))
                    .collect();
                1e3 * (all.iter().sum::<f64>() / all.len() as f64).sqrt()
            };
            for bars in BARS {
                let [raw, slope, now] = [0, 1, 2].map(|kind| rms(kind, bars, bars));
                println!("step of {step} sigma, bars of {bars} mm: {raw:.1}, {slope:.1}, {now:.1}");
            }
            // Narrower ones are hardly wider than a pixel, 0.25 mm.
            let [raw, slope, now] = [0, 1, 2].map(|kind| rms(kind, 1.0, 3.0));
            println!("step of {step} sigma, bars from 1 mm on: {raw:.1}, {slope:.1}, {now:.1}");
            if now > most * slope {
                faults.push(format!("step of {step} sigma: {slope:.1} -> {now:.1} um, allowed {most} of it"));
            }
        }
        assert!(faults.is_empty(), "{}", faults.join("\n"));
    }
}
