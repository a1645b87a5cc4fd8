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
#[path = "thick_tests.rs"]
mod tests;
