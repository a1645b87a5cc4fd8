//! In: a cloud, shot by shot. Out: each shot's line with two quantities for each of its points: how fast the light
//! grows there from shot to shot, and how far the point moves along its ray when the sheet moves.
//! Frame and unit: the cloud's frame, mm; docs/math.md, Sheets that are thick (2) and (3).

use crate::fault::Result;
use crate::geometry::{Base, Plane, Vec3};
use crate::scan::{Along, CloudPoint, PointSource, Shots};
use rayon::prelude::*;
use std::sync::Arc;

/// Points of another line count as neighbours up to this many pixels along the stripe, closer ones with more weight.
const BESIDE_PX: f32 = 1.5;
/// Least stripe width, px, for narrower or unmeasured stripes: centres on one surface differ by less than a pixel.
const LEAST_PX: f32 = 1.0;
/// Largest change of the light from one shot to the next, as a logarithm; larger ones are clamped to it. There the
/// light ends, and where between the two shots is unknown.
const MOST: f64 = 1.5;
/// Change of the light towards a shot that has no point near, because the surface or its light ends before. A bell of
/// light that is cut anywhere between two shots moves as a change of ln 2 moves it, on average; of those cut most the
/// fit refuses some. 0.3 to 0.6 was measured.
const DARK: f64 = 0.45;
/// Weight of a neighbouring line's points below which it counts as dark in part, over 1.
const SEEN: f64 = 0.25;

/// What a point's neighbours in the shots before and after show about it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pull {
    /// Change of the light's logarithm from shot to shot.
    pub change: f64,
    /// Difference between the mean of the neighbours' logarithms and the point's own. It marks light that falls on
    /// an edge, or on a line thinner than the shots resolve.
    pub dip: f64,
    /// Displacement of the point for a change of 1 and a sheet of variance 1 mm².
    pub per: Vec3,
}

/// A shot's points.
pub(super) struct Line {
    pub shot: u32,
    pub points: Vec<CloudPoint>,
    /// Logarithms of the points' intensity.
    lights: Vec<f64>,
    /// Pinhole and sheet at the shot, if its pose is known.
    place: Option<Place>,
    /// Indices of the points in their order along the stripe, with their positions there, px.
    order: Vec<(f32, u32)>,
    along: Along,
    /// Distance across the stripe at which a neighbour's weight is halved, px.
    width_px: f32,
}

/// Pinhole and sheet of a shot.
struct Place {
    eye: Vec3,
    sheet: Plane<Base>,
}

/// A line, and what its neighbours show about its points, one entry a point.
#[derive(Clone)]
pub(super) struct Pulled {
    pub line: Arc<Line>,
    pub pulls: Vec<Pull>,
}

/// Position of a point along its stripe and across it, px.
fn in_picture(along: Along, p: &CloudPoint) -> (f32, f32) {
    if along == Along::U { (p.u, p.v) } else { (p.v, p.u) }
}

fn light(p: &CloudPoint) -> f64 {
    f64::from(p.intensity.max(f32::MIN_POSITIVE)).ln()
}

impl Line {
    fn new(shot: u32, points: Vec<CloudPoint>, shots: &Shots) -> Line {
        let place = shots.place(shot).zip(shots.sheet).and_then(|(place, sheet)| {
            let normal = place.direction(&sheet.normal);
            let on = place.point(&(sheet.normal * sheet.offset));
            Some(Place { eye: place.point(&Vec3::zeros()), sheet: Plane::new(normal, normal.dot(&on))? })
        });
        let mut order: Vec<(f32, u32)> =
            points.iter().zip(0..).map(|(p, i)| (in_picture(shots.along, p).0, i)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let lights = points.iter().map(light).collect();
        let width_px = shots.stripe_px.unwrap_or(0.0).max(LEAST_PX);
        Line { shot, points, lights, place, order, along: shots.along, width_px }
    }

    /// This line's points that are neighbours of a point of another line: index, distances along and across the
    /// stripe, px.
    fn beside(&self, p: &CloudPoint) -> impl Iterator<Item = (usize, f32, f32)> + '_ {
        let (along, across) = in_picture(self.along, p);
        let first = self.order.partition_point(|(a, _)| *a <= along - BESIDE_PX);
        let near = self.order[first..].iter().take_while(move |(a, _)| *a < along + BESIDE_PX);
        near.map(move |(a, i)| {
            let i = *i as usize;
            (i, (a - along).abs(), (in_picture(self.along, &self.points[i]).1 - across).abs())
        })
    }

    /// This line's point that is nearest to a point of another line.
    pub fn nearest(&self, p: &CloudPoint) -> Option<usize> {
        let square = |(_, along, across): &(usize, f32, f32)| along * along + across * across;
        self.beside(p).min_by(|a, b| square(a).total_cmp(&square(b))).map(|(i, _, _)| i)
    }

    /// Logarithm of the light next to a point of another line, and the weight of the points found there, 0..=1. The
    /// mean's weights are continuous, so that small shifts of this line's points do not cause jumps. Points several
    /// stripe widths away across it are of another surface and count little.
    fn light(&self, p: &CloudPoint) -> (f64, f64) {
        let (mut sum, mut sure, mut all) = (0.0, 0.0, 0.0);
        for (i, along, across) in self.beside(p) {
            let weight = f64::from((1.0 - along / BESIDE_PX) / (1.0 + (across / self.width_px).powi(2)));
            // A fit that determines its position poorly determines its intensity poorly too.
            let known = weight / f64::from(self.points[i].sigma_mm.max(1e-6)).powi(2);
            sum += known * self.lights[i];
            sure += known;
            all += weight;
        }
        if sure > 0.0 { (sum / sure, all.min(1.0)) } else { (0.0, 0.0) }
    }

    /// What two neighbouring lines show about a point of this one.
    fn pull(&self, i: usize, before: Option<&Line>, after: Option<&Line>) -> Pull {
        let p = &self.points[i];
        let (at, here) = (p.at(), self.light(p).0);
        let Some(Place { eye, sheet }) = &self.place else { return Pull::default() };
        let ray = at - eye;
        // Of a neighbouring line: how much brighter it is next to the point, the distance of its sheet from the
        // point along the normal, its weight, and how far it is dark there.
        let beside = |line: Option<&Line>| {
            let line = line?;
            let way = -line.place.as_ref()?.sheet.distance(&at);
            let (light, weight) = line.light(p);
            Some([(light - here).clamp(-MOST, MOST), way, weight, (1.0 - weight / SEEN).max(0.0)])
        };
        let [a, from, before, dark_before] = beside(before).unwrap_or_default();
        let [b, to, after, dark_after] = beside(after).unwrap_or_default();
        // If both sheets lie on the same side of the point, the point is not between them.
        if before + after <= 0.0 || before * after > 0.0 && from * to > 0.0 {
            return Pull::default();
        }
        let ends = DARK * (dark_before - dark_after);
        let change = (after * b - before * a) / (before + after).max(1.0) + ends;
        let way = (after * to - before * from) / (before + after);
        let dip = 0.5 * (a + b) * before.min(after);
        let per = ray / (ray.dot(&sheet.normal) * way);
        if per.iter().all(|x| x.is_finite()) { Pull { change, dip, per } } else { Pull::default() }
    }

    fn pulled(self: Arc<Line>, before: Option<&Line>, after: Option<&Line>) -> Pulled {
        // Only adjacent shots are neighbours. Across dark and missing shots it is unknown what happened between.
        let next = |line: &&Line| line.shot.abs_diff(self.shot) == 1;
        let (before, after) = (before.filter(next), after.filter(next));
        let pulls =
            (0..self.points.len()).into_par_iter().with_min_len(64).map(|i| self.pull(i, before, after)).collect();
        Pulled { line: self, pulls }
    }
}

/// Passes the lines of a cloud, whose points come in the order of their shots, to `take` in that order.
pub(super) fn lines(cloud: &dyn PointSource, shots: &Shots, take: &mut dyn FnMut(Pulled) -> Result<()>) -> Result<()> {
    let (mut before, mut last): (Option<Arc<Line>>, Option<Arc<Line>>) = (None, None);
    let mut next: Vec<CloudPoint> = Vec::new();
    let mut close = |points: Vec<CloudPoint>| -> Result<()> {
        let line = points.first().map(|p| p.shot).map(|shot| Arc::new(Line::new(shot, points, shots)));
        let done = last.clone().map_or(Ok(()), |last| take(last.pulled(before.as_deref(), line.as_deref())));
        before = std::mem::replace(&mut last, line);
        done
    };
    let mut closed = Ok(());
    cloud.for_each_chunk(&mut |points| {
        for line in points.chunk_by(|a, b| a.shot == b.shot) {
            if next.first().is_some_and(|p| p.shot != line[0].shot) && closed.is_ok() {
                closed = close(std::mem::take(&mut next));
            }
            next.extend_from_slice(line);
        }
    })?;
    closed?;
    close(next)?;
    close(Vec::new())
}
