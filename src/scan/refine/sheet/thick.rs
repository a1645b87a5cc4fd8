//! In: a scan's lines with what their neighbours show. Out: the sheet's thickness as the cloud shows it, and the
//! points without its effect where brightness changes.
//! Frame and unit: the cloud's frame, mm; docs/math.md, Sheets that are thick.

use super::super::slope::{Slope, slope};
use super::lines::{Neighbours, Pull, Pulled, least_way, lines, nearest};
use crate::fault::Result;
use crate::scan::{CloudPoint, PointSource, Shots};
use crate::solve::robust_scale;
use std::collections::VecDeque;

/// A point is compared with its neighbours if it lies between them, at least this share of their distance from each.
const BETWEEN: f64 = 0.2;
/// The neighbours' depths must differ by less than this share of their distance: a comparison across an edge is
/// useless.
const LEVEL: f64 = 0.6;
/// Residuals beyond this many robust deviations are edges.
const EDGE: f64 = 10.0;
/// Changes of light from shot to shot within this many of their robust deviations count as speckle and noise. A
/// point in 80 of pure noise is moved.
const SPECKLE: f64 = 2.5;
/// Upper bound of that limit: on a mostly printed surface the usual changes are the print itself.
const UNCHANGED: f64 = 0.25;
/// With fewer comparisons nothing is concluded.
const FEWEST: usize = 256;
/// Above this number comparisons are thinned out.
const MOST: usize = 1 << 16;
const ROUNDS: usize = 5;
/// Most shots to a neighbour.
const FARTHEST: u32 = 16;

/// Effect of the sheet's thickness where brightness changes; in scan.json.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SheetFound {
    /// Standard deviation of the light across the sheet, as its effect shows it, mm. It is within 0.7 and 1.6 of the
    /// real one, and less if shots lie farther apart than three of those.
    pub thickness_mm: f64,
    /// Standard deviation of that.
    pub thickness_sigma_mm: f64,
    /// The remaining scatter where brightness changes equals the shifts by a sheet of this standard deviation, mm.
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
        write!(f, "The remaining scatter equals that of a {scatter_mm:.3} mm sheet; the points' sigma contains it.")
    }
}

/// What a cloud shows about its sheet.
#[derive(Clone, Copy, Debug)]
pub struct Thick {
    /// Variance of the sheet, mm².
    square: Slope,
    /// Remaining scatter of the points about that effect, as a variance of the sheet, mm².
    left: f64,
    quiet: Quiet,
    /// The neighbours that showed it.
    near: Neighbours,
    /// Mean square of what is left of the comparisons, in their stated deviations; edges are clamped.
    rest: f64,
}

/// Limits of changes and dips that are speckle and noise.
#[derive(Clone, Copy, Debug)]
struct Quiet {
    change: f64,
    dip: f64,
}

/// One of three points that are compared.
#[derive(Clone, Copy)]
struct Part {
    change: f64,
    dip: f64,
    /// Shift of the comparison along the ray for a change of 1 and a sheet of 1 mm², mm.
    by: f64,
}

/// A point between its two neighbours.
#[derive(Clone, Copy)]
struct Between {
    /// Its distance beyond them along its ray, mm, and the stated variance of that distance from all three.
    beyond: f64,
    stated: f64,
    /// The point itself and the two neighbours.
    parts: [Part; 3],
}

impl Thick {
    /// Examines a cloud in the order of its shots. `None` if the sheet is not recorded, or if the cloud does not
    /// show that brightness shifts its points. Where shots are finer than the sheet, the brightness hardly changes from
    /// one to the next, and what does is noise: of neighbours farther away those count that leave the least.
    pub fn of(cloud: &dyn PointSource, shots: &Shots) -> Result<Option<Thick>> {
        let least_way = least_way(cloud, shots)?;
        let adjacent = Neighbours { reach: 1, ends: 0, least_way };
        let (adjacent, far, noise) = Thick::by(cloud, shots, adjacent, 1, UNCHANGED)?;
        let powers = || (0..).map(|k| 1 << k).take_while(|reach| *reach <= FARTHEST && f64::from(*reach) <= far);
        let apart = powers().last().unwrap_or(1);
        if apart == 1 {
            return Ok(adjacent);
        }
        let mut best: Option<Thick> = None;
        for reach in powers() {
            let most = UNCHANGED.max(SPECKLE * noise / (nearest(reach).count() as f64).sqrt());
            let near = Neighbours { reach, ends: reach + apart, least_way };
            let thick = Thick::by(cloud, shots, near, apart, most)?.0;
            let rest = |thick: &Option<Thick>| thick.map_or(f64::INFINITY, |thick| thick.rest);
            if rest(&thick) < rest(&best) {
                best = thick;
            }
        }
        Ok(best)
    }

    /// What neighbours show by comparisons with points `apart` shots away, where `most` bounds the changes that count
    /// as noise; how many shots away neighbours may be; and the noise of a change. A dip has the noise of three
    /// independent lights where a change has that of one.
    fn by(
        cloud: &dyn PointSource,
        shots: &Shots,
        neighbours: Neighbours,
        apart: u32,
        most: f64,
    ) -> Result<(Option<Thick>, f64, f64)> {
        let (mut all, mut every, mut seen) = (Vec::new(), 1, 0_usize);
        let (mut near, mut far): (VecDeque<Pulled>, Vec<f64>) = (VecDeque::new(), Vec::new());
        let apart = apart as usize;
        lines(cloud, shots, neighbours, &mut |line| {
            far.extend(line.far);
            near.push_back(line);
            if near.len() == 2 * apart + 1 {
                let (before, line, after) = (&near[0], &near[apart], &near[2 * apart]);
                for i in 0..line.pulls.len() {
                    let Some(between) = between(before, line, i, after) else { continue };
                    if seen.is_multiple_of(every) {
                        all.push(between);
                    }
                    seen += 1;
                    if all.len() == MOST {
                        let mut k = 0;
                        all.retain(|_| (k += 1, k % 2 == 1).1);
                        every *= 2;
                    }
                }
                near.pop_front();
            }
            Ok(())
        })?;
        far.sort_by(f64::total_cmp);
        let far = far.get(far.len() / 2).copied().unwrap_or(0.0);
        if all.len() < FEWEST {
            return Ok((None, far, 0.0));
        }
        let scale = |of: fn(&Part) -> f64| {
            let mut sizes: Vec<f64> = all.iter().map(|b: &Between| of(&b.parts[0]).abs()).collect();
            robust_scale(&mut sizes, 1)
        };
        let (change, dip) = (scale(|p| p.change), scale(|p| p.dip));
        let quiet = Quiet { change: (SPECKLE * change).min(most), dip: (SPECKLE * dip).min(most) };
        Ok((Thick::shown(&all, neighbours, quiet), far, change.min(dip / 3f64.sqrt())))
    }

    /// What comparisons show.
    fn shown(all: &[Between], near: Neighbours, quiet: Quiet) -> Option<Thick> {
        let pulls = |b: &Between| b.parts.iter().map(|p| quiet.change_of(p.change) * p.by).sum::<f64>();
        let pairs: Vec<[f64; 2]> = all.iter().map(|b| [-pulls(b), b.beyond]).collect();
        let square = slope(&pairs).filter(Slope::sure)?;
        let unsure = |b: &Between| b.parts.iter().map(|p| (quiet.unsure(p.change, p.dip) * p.by).powi(2)).sum::<f64>();
        let of_pair = |(b, [expected, seen]): (&Between, &[f64; 2])| [unsure(b), seen - square.is * expected, b.stated];
        let rests: Vec<[f64; 3]> = all.iter().zip(&pairs).map(of_pair).collect();
        let left = left(&rests, square.is);
        let over = rests.iter().map(|[_, rest, stated]| (rest * rest / stated).min(EDGE * EDGE));
        let rest = over.sum::<f64>() / rests.len() as f64;
        Some(Thick { square, left, quiet, near, rest })
    }

    /// Passes the corrected points to `take`, line by line in their order.
    pub fn apply(
        &self,
        cloud: &dyn PointSource,
        shots: &Shots,
        take: &mut dyn FnMut(&[CloudPoint]) -> Result<()>,
    ) -> Result<SheetFound> {
        let (mut moved, mut points, mut all) = (0_u64, Vec::new(), 0_u64);
        lines(cloud, shots, self.near, &mut |Pulled { line, pulls, .. }| {
            points.clear();
            for (p, Pull { change, dip, per }) in line.points.iter().zip(&pulls) {
                let by = per * (self.quiet.change_of(*change) * self.square.is);
                moved += u64::from(by.norm() as f32 > p.sigma_mm);
                let moved_to = p.moved_to(p.at() + by);
                let scatter = per.norm() * self.quiet.unsure(*change, *dip) * self.left;
                points.push(CloudPoint { sigma_mm: p.sigma_mm.hypot(scatter as f32), ..moved_to });
            }
            all += points.len() as u64;
            take(&points)
        })?;
        let thickness_mm = self.square.is.sqrt();
        Ok(SheetFound {
            thickness_mm,
            thickness_sigma_mm: 0.5 * self.square.sigma / thickness_mm,
            scatter_mm: self.left.sqrt(),
            moved: moved as f64 / all.max(1) as f64,
        })
    }
}

impl Quiet {
    /// The part of a change that exceeds speckle and noise.
    fn change_of(&self, change: f64) -> f64 {
        beyond(change, self.change)
    }

    /// Uncertainty that change and dip leave about the light's middle, expressed as the size of a change.
    fn unsure(&self, change: f64, dip: f64) -> f64 {
        self.change_of(change).hypot(beyond(dip, self.dip))
    }
}

/// Soft threshold: 0 within `size`, the number itself beyond twice `size`, and linear between the two. It has no
/// step, so that a result never depends on which side of a limit a number lies.
fn beyond(number: f64, size: f64) -> f64 {
    let over = number.abs() - size;
    number.signum() * (2.0 * over).clamp(0.0, number.abs())
}

/// Scatter of the points where brightness changes, as a variance of the sheet. Each entry is (sum of squares of what
/// is unsure, residual, its stated variance). The stated variance is scaled to the residuals' usual size; the slope
/// of the squared residuals beyond it is fitted by weighted least squares. The result is at least `square`, because
/// on a surface that is printed all over most residuals contain shifts already.
fn left(rests: &[[f64; 3]], square: f64) -> f64 {
    let mut over: Vec<f64> = rests.iter().map(|[_, rest, stated]| rest.abs() / stated.sqrt()).collect();
    let usual = robust_scale(&mut over, 1).powi(2);
    let noisy = rests.iter().map(|[unsure, rest, stated]| (*unsure, rest * rest, usual * stated));
    let near: Vec<(f64, f64, f64)> = noisy.filter(|(_, rest, noise)| *rest < EDGE * EDGE * noise).collect();
    let mut grows = square * square;
    for _ in 0..ROUNDS {
        let (mut all, mut across) = (0.0, 0.0);
        for &(unsure, rest, noise) in &near {
            let weight = (noise + grows * unsure).powi(-2) * unsure;
            all += weight * unsure;
            across += weight * (rest - noise);
        }
        if all <= 0.0 {
            return square;
        }
        grows = (across / all).max(square * square);
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
    let part = |&Pull { change, dip, per }: &Pull, part: f64| Part { change, dip, by: part * per.dot(&ray) };
    let stated = |p: &CloudPoint, part: f64| (f64::from(p.sigma_mm) * part).powi(2);
    let stated = stated(p, 1.0) + stated(&before.line.points[j], 1.0 - share) + stated(&after.line.points[k], share);
    // A fit that its light does not determine states any size, even infinite or NaN.
    stated.is_normal().then_some(Between {
        beyond: to.dot(&ray) - share * deeper,
        stated,
        parts: [part(pull, 1.0), part(&before.pulls[j], share - 1.0), part(&after.pulls[k], -share)],
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
        /// Number of steps that the camera has gone at a shot.
        gone: fn(u32) -> f64,
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
    }

    /// Printed lines 1.6 mm wide with gaps as wide, edges 0.15 mm wide, four times as bright as the ground.
    fn print(x: f64, y: f64) -> f64 {
        let wave = (y / 1.6 * std::f64::consts::PI + 0.3 * x).sin();
        0.25 + 0.75 / (1.0 + (-wave * 1.6 / std::f64::consts::PI / 0.05).exp())
    }

    const PRINTED: Scene = Scene {
        shots: 60,
        along: Along::U,
        gone: f64::from,
        step: 0.25,
        turn: 0.0,
        thick: 0.1,
        height: |x, y| 0.05 * x + 0.1 * y,
        albedo: print,
        speckle: 0.03,
        flicker: 0.0,
        focal_px: 600.0,
    };
    const NOISE_MM: f64 = 0.01;

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
                let k = (self.gone)(shot);
                let turned = exp(&(Vec3::z() * (self.turn * k))) * exp(&(Vec3::x() * std::f64::consts::PI));
                let place: Rigid<Base, Camera> = Rigid::new(turned, Vec3::new(0.0, self.step * k, 150.0));
                let laser = (self.flicker * noise.normal()).exp();
                for column in 0..200 {
                    let x = 0.1 * f64::from(column) - 10.0;
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
                    let at = place.point(&(ray * depth)) + Vec3::z() * (NOISE_MM * noise.normal());
                    let (u, v) = ((self.focal_px * ray.x) as f32, 200.0 + (self.focal_px * ray.y) as f32);
                    let (u, v) = if self.along == Along::U { (u, v) } else { (v, u) };
                    let intensity = (8.0 * laser * light * (self.speckle * noise.normal()).exp()) as f32;
                    let position = glam::DVec3::from_array(at.into()).as_vec3();
                    cloud.push(CloudPoint {
                        position,
                        intensity,
                        sigma_mm: NOISE_MM as f32,
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

    /// Lying and upright stripes, forwards and back, straight and turning, with shots a quarter to 4 standard
    /// deviations of the sheet apart.
    #[test]
    fn print_no_longer_pulls_the_points_about() {
        for (name, scene) in [
            ("as it is", PRINTED),
            ("upright", Scene { along: Along::V, ..PRINTED }),
            ("back", Scene { step: -0.25, ..PRINTED }),
            ("turning", Scene { turn: 0.004, ..PRINTED }),
            ("fine", Scene { step: 0.1, shots: 150, ..PRINTED }),
            ("coarse", Scene { step: 0.35, ..PRINTED }),
            ("dense", Scene { focal_px: 1500.0, step: 0.025, shots: 400, ..PRINTED }),
            ("dense, back, upright", Scene { focal_px: 1500.0, step: -0.025, shots: 400, along: Along::V, ..PRINTED }),
            ("dense, speckled", Scene { focal_px: 1500.0, step: 0.025, shots: 400, speckle: 0.06, ..PRINTED }),
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

    /// Shots of a camera that stands show no slope of the light. They neither throw points far off nor hide the effect.
    #[test]
    fn a_camera_that_stands_ruins_nothing() {
        let stands: [(&str, fn(u32) -> f64, f64); 6] = [
            ("one picture more", |k| f64::from(k - u32::from(k > 20)), 0.7),
            ("four", |k| f64::from(k.min(20) + k.saturating_sub(24)), 0.7),
            ("a third of the scan", |k| f64::from(k.min(20) + k.saturating_sub(40)), 0.9),
            ("at the start and the end", |k| f64::from(k.clamp(8, 50)), 0.8),
            (
                "trembling by 0.01 of a step",
                |k| f64::from(k.min(20) + k.saturating_sub(24)) + 0.01 * f64::from(k % 3),
                0.7,
            ),
            (
                "a slow stretch",
                |k| f64::from(k.min(20)) + 0.1 * f64::from(k.clamp(20, 40) - 20) + f64::from(k.max(40) - 40),
                0.7,
            ),
        ];
        for (name, gone, left) in stands {
            let scene = Scene { gone, ..PRINTED };
            let (found, before, after) = scene.refined(7);
            let found = found.unwrap_or_else(|| panic!("{name}: nothing is found"));
            println!("{name}: {found}; {before:.4} -> {after:.4} mm");
            assert!(after < left * before, "{name}: {before} -> {after}");
            assert!((0.7..1.6).contains(&(found.thickness_mm / scene.thick)), "{name}: {found:?}");
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
        assert!((0.2..0.7).contains(&moved) && (0.1..0.2).contains(&scatter_mm), "{moved}, {scatter_mm}");
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
            ("dense, speckled", Scene { focal_px: 1500.0, step: 0.025, shots: 300, speckle: 0.3, ..even }),
            ("dense, flickering", Scene { focal_px: 1500.0, step: 0.025, shots: 300, flicker: 0.2, ..even }),
            ("dense, thin", Scene { step: 0.025, shots: 300, ..thin }),
            ("dense ridges", Scene { step: 0.025, shots: 300, ..ridges }),
        ] {
            for seed in 0..if scene.shots > 60 { 2 } else { 5 } {
                let (found, before, after) = scene.refined(seed);
                println!("{name}: {found:?}: {before:.4} -> {after:.4}");
                assert!(found.is_none() && before == after, "{name}: {found:?}: {before} -> {after}");
            }
        }
        let (cloud, shots) = PRINTED.scan(1);
        assert!(Thick::of(&cloud, &Shots::unplaced(shots.along)).unwrap().is_none());
        assert!(Thick::of(&Vec::new(), &shots).unwrap().is_none());
    }
}
