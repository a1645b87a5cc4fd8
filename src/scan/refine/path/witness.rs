//! In: a cloud, shot by shot. Out: the distance of each shot's line from the surface between the shots before and
//! after it, left and right of its middle.
//! Frame and unit: the cloud's frame, mm; docs/math.md, Places that scatter (3).

use super::sides::{Side, halves};
use crate::fault::Result;
use crate::geometry::Vec3;
use crate::scan::{Along, CloudPoint, PointSource};

/// Positions along the stripe at which a shot is compared: enough to average out noise, few enough for large
/// pictures.
const PLACES: f32 = 512.0;
/// A surface's slope along the stripe is taken over this many positions to both sides.
const BESIDE: usize = 3;
/// A shot lies between its neighbours if its distance from each is at least this share of their distance.
const BETWEEN: f64 = 0.1;

/// What half of a shot's line shows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    /// The shot, and those before and after it.
    pub shots: [u32; 3],
    /// Position, and the surface's unit normal there.
    pub at: Vec3,
    pub normal: Vec3,
    /// Unit vector along the stripe.
    pub along: Vec3,
    /// Distance from the neighbours' surface along the normal, mm.
    pub off: f64,
    /// Weight of the shot after in that surface.
    pub after: f64,
}

/// A shot's points by position along the stripe.
struct Line {
    shot: u32,
    /// Sum of the positions and their number.
    places: Vec<(Vec3, f64)>,
}

impl Line {
    fn at(&self, place: usize) -> Option<Vec3> {
        self.places.get(place).filter(|(_, n)| *n > 0.0).map(|(sum, n)| sum / *n)
    }
    fn take(&mut self, along: Along, px: f32, p: &CloudPoint) {
        let place = (if along == Along::U { p.u } else { p.v } / px).max(0.0) as usize;
        if place >= self.places.len() {
            self.places.resize(place + 1, (Vec3::zeros(), 0.0));
        }
        let (sum, n) = &mut self.places[place];
        *sum += p.at();
        *n += 1.0;
    }
}

/// The cloud's points must come in the order of their shots; `along_px` is the pictures' size along the stripe.
pub(super) fn steps(cloud: &dyn PointSource, along: Along, along_px: u32) -> Result<Vec<Step>> {
    let px = (along_px as f32 / PLACES).ceil().max(1.0);
    let mut lines: [Option<Line>; 3] = [None, None, None];
    let mut steps = Vec::new();
    cloud.for_each_chunk(&mut |points| {
        for p in points {
            if lines[2].as_ref().is_none_or(|l| l.shot != p.shot) {
                steps.extend(of_three(&lines));
                lines.rotate_left(1);
                lines[2] = Some(Line { shot: p.shot, places: Vec::new() });
            }
            if let Some(line) = &mut lines[2] {
                line.take(along, px, p);
            }
        }
    })?;
    steps.extend(of_three(&lines));
    Ok(steps)
}

/// Both halves of the middle one of three lines; empty for a line with too few points.
fn of_three(lines: &[Option<Line>; 3]) -> Vec<Step> {
    let [Some(before), Some(line), Some(after)] = lines else { return Vec::new() };
    let places = (BESIDE..line.places.len()).filter_map(|k| {
        let (a, b) = (line.at(k - BESIDE)?, line.at(k + BESIDE)?);
        let (p, q, r) = (before.at(k)?, line.at(k)?, after.at(k)?);
        let apart = r - p;
        let normal = (b - a).cross(&apart).try_normalize(1e-9)?;
        let share = (q - p).dot(&apart) / apart.norm_squared();
        let between = (BETWEEN..=1.0 - BETWEEN).contains(&share);
        let along = (b - a).normalize();
        between.then(|| Side { at: q, normal, along, off: normal.dot(&(q - p - share * apart)), after: share })
    });
    let shots = [line.shot, before.shot, after.shot];
    let step = |s: Side| Step { shots, at: s.at, normal: s.normal, along: s.along, off: s.off, after: s.after };
    halves(places.collect()).into_iter().flatten().map(step).collect()
}
