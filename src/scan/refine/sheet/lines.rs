//! In: a cloud, shot by shot, and how many shots away neighbours are. Out: each shot's line with two quantities for
//! each of its points: how fast the light grows there over those shots, and how far the point moves along its ray when
//! the sheet moves.
//! Frame and unit: the cloud's frame, mm; docs/math.md, Sheets that are thick (2) and (3).

use crate::fault::Result;
use crate::geometry::{Base, Plane, Vec3};
use crate::scan::{Along, CloudPoint, PointSource, Shots};
use rayon::prelude::*;
use std::collections::VecDeque;
use std::sync::Arc;

/// Points of another line count as neighbours up to this many pixels along the stripe, closer ones with more weight.
const BESIDE_PX: f32 = 1.5;
/// Least stripe width, px, for narrower or unmeasured stripes: centres on one surface differ by less than a pixel.
const LEAST_PX: f32 = 1.0;
/// Variance of the stripe that is the picture's blur, px², as in the stages (docs/math.md, (9)).
const BLUR: f32 = 0.35;
/// Largest change of the light from one shot to the next, as a logarithm; larger ones are clamped to it. There the
/// light ends, and where between the two shots is unknown.
const MOST: f64 = 1.5;
/// Change of the light towards a shot that has no point near, because the surface or its light ends before. A bell of
/// light that is cut anywhere between two shots moves as a change of ln 2 moves it, on average; of those cut most the
/// fit refuses some. 0.3 to 0.6 was measured.
const DARK: f64 = 0.45;
/// Weight of a neighbouring line's points below which it counts as dark in part, over 1.
const SEEN: f64 = 0.25;
/// A shot whose sheet lies nearer than this share of the usual way from shot to shot shows no change of the light: the
/// camera stood still, and noise divided by almost no way would be any slope.
const STANDING: f64 = 0.25;
/// Share of the scan's whole way that consists of steps of the usual way and longer ones. Pictures of a camera that
/// stands add little to it however many they are, and the long ways between two passes are few.
const USUAL: f64 = 0.75;
/// Lines to each side that are stepped over at most because the camera stood. It may stand longer: the points between
/// have no neighbours and stay.
const HELD: u32 = 7;
/// Lines whose neighbours are compared at once, on all processor cores.
const TOGETHER: usize = 64;
/// Points of a line at which its way to another is measured.
const SAMPLES: usize = 64;

/// Which shots are neighbours.
#[derive(Clone, Copy, Debug)]
pub(super) struct Neighbours {
    /// Number of shots within which they are.
    pub reach: u32,
    /// Number of shots within which the light's end is looked for; 0 if shots are coarser than the sheet.
    pub ends: u32,
    /// Least way from one to the next, mm.
    pub least_way: f64,
}

/// What a point's neighbours in the shots before and after show about it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pull {
    /// Change of the light's logarithm over the reach, which is a number of shots.
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
    /// Standard deviation of the sheet, mm, from the stripe's width where the line has its middle; 0 if the picture's
    /// blur hides it.
    sheet_mm: f64,
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
    /// How many shots away neighbours may be here.
    pub far: Option<f64>,
}

/// Position of a point along its stripe and across it, px.
fn in_picture(along: Along, p: &CloudPoint) -> (f32, f32) {
    if along == Along::U { (p.u, p.v) } else { (p.v, p.u) }
}

impl Place {
    fn of(shot: u32, shots: &Shots) -> Option<Place> {
        let (place, sheet) = shots.place(shot).zip(shots.sheet)?;
        let normal = place.direction(&sheet.normal);
        let on = place.point(&(sheet.normal * sheet.offset));
        Some(Place { eye: place.point(&Vec3::zeros()), sheet: Plane::new(normal, normal.dot(&on))? })
    }

    /// Mean distance of the sheet from the points of another line, mm: the way from shot to shot.
    fn way(&self, points: &[CloudPoint]) -> f64 {
        let some = points.iter().step_by(points.len().div_ceil(SAMPLES).max(1));
        let (sum, n) = some.fold((0.0, 0.0), |(sum, n), p| (sum + self.sheet.distance(&p.at()).abs(), n + 1.0));
        sum / n
    }
}

/// Least way between two shots at which one shows how the light changes at the other, mm, from the ways between all
/// successive shots of the cloud.
pub(super) fn least_way(cloud: &dyn PointSource, shots: &Shots) -> Result<f64> {
    let mut ways = Vec::new();
    cloud.for_each_chunk(&mut |points| {
        for line in points.chunk_by(|a, b| a.shot == b.shot) {
            let before = line[0].shot.checked_sub(1).and_then(|shot| Place::of(shot, shots));
            ways.extend(before.map(|place| place.way(line)).filter(|way| way.is_finite()));
        }
    })?;
    ways.sort_by(|a, b| b.total_cmp(a));
    let enough = USUAL * ways.iter().sum::<f64>();
    let mut sum = 0.0;
    let usual = ways.into_iter().find(|way| {
        sum += way;
        sum >= enough
    });
    Ok(STANDING * usual.unwrap_or(0.0))
}

fn light(p: &CloudPoint) -> f64 {
    f64::from(p.intensity.max(f32::MIN_POSITIVE)).ln()
}

impl Line {
    fn new(shot: u32, points: Vec<CloudPoint>, shots: &Shots) -> Line {
        let place = Place::of(shot, shots);
        let mut order: Vec<(f32, u32)> =
            points.iter().zip(0..).map(|(p, i)| (in_picture(shots.along, p).0, i)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let lights = points.iter().map(light).collect();
        let stripe_px = shots.stripe_px.unwrap_or(0.0);
        let width_px = stripe_px.max(LEAST_PX);
        let mut line = Line { shot, points, lights, place, order, along: shots.along, width_px, sheet_mm: 0.0 };
        let sheet_px = f64::from(stripe_px * stripe_px - BLUR).max(0.0).sqrt();
        line.sheet_mm = line.mm_per_px().map_or(0.0, |mm| sheet_px * mm);
        line
    }

    /// How far the sheet stands from the place that is seen a pixel beside its own, mm, in the middle of the line on a
    /// surface that the camera looks at squarely.
    fn mm_per_px(&self) -> Option<f64> {
        let middle = self.order.len() / 2;
        let (one, two) = (self.order.get(middle)?, self.order.get(middle + 1)?);
        let (p, q) = (self.points[one.1 as usize].at(), self.points[two.1 as usize].at());
        let footprint = (q - p).norm() / f64::from(two.0 - one.0);
        let Place { eye, sheet } = self.place.as_ref()?;
        let across = (p - eye).normalize().dot(&sheet.normal);
        let mm = footprint * (1.0 - across * across).max(0.0).sqrt();
        mm.is_finite().then_some(mm)
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

    /// What a neighbouring line shows about a point of this one: how much brighter it is next to the point, the
    /// distance of its sheet from the point along the normal, its weight, and how far it is dark there.
    fn shown_by(&self, p: &CloudPoint, here: f64, line: Option<&Arc<Line>>) -> Option<[f64; 4]> {
        let line = line?;
        let way = -line.place.as_ref()?.sheet.distance(&p.at());
        let (light, weight) = line.light(p);
        Some([(light - here).clamp(-MOST, MOST), way, weight, (1.0 - weight / SEEN).max(0.0)])
    }

    /// Share of a point's light that does not end at any of these lines.
    fn lit(&self, p: &CloudPoint, lines: &[Arc<Line>]) -> f64 {
        lines.iter().map(|line| (line.light(p).1 / SEEN).min(1.0)).product()
    }

    /// What neighbouring lines show about a point of this one: `pairs` as far before it as after it. Where the light
    /// ends at one of the lines `beyond`, the neighbours' bells of light are cut: their height then says little about
    /// the surface's brightness, and nothing is concluded.
    fn pull(&self, i: usize, pairs: &[[Option<&Arc<Line>>; 2]], beyond: Option<&[Arc<Line>]>) -> Pull {
        let p = &self.points[i];
        let (at, here) = (p.at(), self.light(p).0);
        let Some(Place { eye, sheet }) = &self.place else { return Pull::default() };
        let ray = at - eye;
        let lit = beyond.map(|lines| self.lit(p, lines));
        let dark = if lit.is_some() { 0.0 } else { DARK };
        // The slope of the light over the sheet's way, by least squares.
        let (mut across, mut square, mut dips, mut count, mut forward) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for [before, after] in pairs {
            let [a, from, before, dark_before] = self.shown_by(p, here, *before).unwrap_or_default();
            let [b, to, after, dark_after] = self.shown_by(p, here, *after).unwrap_or_default();
            // If both sheets lie on the same side of the point, the point is not between them.
            if before + after <= 0.0 || before * after > 0.0 && from * to > 0.0 {
                continue;
            }
            let ends = dark * (dark_before - dark_after);
            let change = (after * b - before * a) / (before + after).max(1.0) + ends;
            let way = (after * to - before * from) / (before + after);
            across += way * change;
            square += way * way;
            dips += 0.5 * (a + b) * before.min(after);
            forward += way;
            count += 1.0;
        }
        let way = (square / f64::max(count, 1.0)).sqrt().copysign(forward);
        let per = ray / (ray.dot(&sheet.normal) * way);
        let lit = lit.unwrap_or(1.0);
        let (change, dip) = (lit * (across / square * way), lit * (dips / f64::max(count, 1.0)));
        if per.iter().all(|x| x.is_finite()) && change.is_finite() {
            Pull { change, dip, per }
        } else {
            Pull::default()
        }
    }

    /// How many shots away neighbours may be, by a point in the middle of this line: the way of the sheet to the next
    /// shot, in twice its standard deviation. `None` without neighbours.
    fn far(&self, next: &Line) -> Option<f64> {
        let p = &self.points[self.order.get(self.order.len() / 2)?.1 as usize];
        let far = 2.0 * self.sheet_mm / next.place.as_ref()?.sheet.distance(&p.at()).abs();
        far.is_finite().then_some(far)
    }

    /// The lines to one side of this one in their order, of `company`, whose sheets have moved on. Only successive
    /// shots are neighbours: across dark and missing shots it is unknown what happened between.
    fn beyond<'a>(&self, company: &'a VecDeque<Arc<Line>>, side: i64, near: Neighbours) -> Vec<&'a Arc<Line>> {
        let has = |shot: i64| company.iter().find(|line| i64::from(line.shot) == shot);
        let successive = (1..).map_while(|k| has(i64::from(self.shot) + side * k));
        let mut last = 0.0;
        let moved = |line: &&Arc<Line>| {
            let Some(place) = &line.place else { return true };
            let way = place.way(&self.points);
            let moved = way - last >= near.least_way;
            last = if moved { way } else { last };
            moved
        };
        successive.take(near.within() as usize).filter(moved).take(near.reach.max(near.ends) as usize).collect()
    }

    /// `company` are the lines near this one, in their order.
    fn pulled(self: Arc<Line>, company: &VecDeque<Arc<Line>>, near: Neighbours) -> Pulled {
        let (before, after) = (self.beyond(company, -1, near), self.beyond(company, 1, near));
        let far = after.first().and_then(|next| self.far(next));
        let pairs: Vec<[Option<&Arc<Line>>; 2]> =
            nearest(near.reach).map(|k| [before.get(k - 1).copied(), after.get(k - 1).copied()]).collect();
        // An edge darkens all lines beyond it: every eighth of the distance is enough.
        let every = (near.ends as usize).div_ceil(8);
        let some = |lines: Vec<&Arc<Line>>| lines.into_iter().rev().step_by(every).cloned().collect::<Vec<_>>();
        let beyond = (near.ends > 0).then(|| [some(before), some(after)].concat());
        let pull = |i| self.pull(i, &pairs, beyond.as_deref());
        let pulls = (0..self.points.len()).map(pull).collect();
        Pulled { line: self.clone(), pulls, far }
    }
}

impl Neighbours {
    /// Number of lines to each side that may be needed.
    fn within(self) -> u32 {
        self.reach.max(self.ends) + HELD
    }
}

/// How many shots away the neighbours are that count within a reach: nearer ones add noise and little else.
pub(super) fn nearest(reach: u32) -> std::ops::RangeInclusive<usize> {
    reach as usize / 2 + 1..=reach as usize
}

/// Passes the lines of a cloud, whose points come in the order of their shots, to `take` in that order.
pub(super) fn lines(
    cloud: &dyn PointSource,
    shots: &Shots,
    neighbours: Neighbours,
    take: &mut dyn FnMut(Pulled) -> Result<()>,
) -> Result<()> {
    let within = neighbours.within();
    // The lines near those that were not passed on yet, and the number of those before them.
    let (mut near, mut done): (VecDeque<Arc<Line>>, usize) = (VecDeque::new(), 0);
    let mut pass = |near: &mut VecDeque<Arc<Line>>, upto: u64| -> Result<()> {
        let known = |line: &&Arc<Line>| u64::from(line.shot) + u64::from(within) <= upto;
        let ready = near.range(done..).take_while(known).count();
        if ready < TOGETHER && upto < u64::MAX {
            return Ok(());
        }
        let pulled = |line: &Arc<Line>| line.clone().pulled(near, neighbours);
        let pulled: Vec<Pulled> =
            near.range(done..done + ready).collect::<Vec<_>>().into_par_iter().map(pulled).collect();
        pulled.into_iter().try_for_each(&mut *take)?;
        done += ready;
        while near.get(done).is_some_and(|next| near[0].shot + within < next.shot) {
            near.pop_front();
            done -= 1;
        }
        Ok(())
    };
    let mut next: Vec<CloudPoint> = Vec::new();
    let mut close = |points: Vec<CloudPoint>| -> Result<()> {
        let Some(shot) = points.first().map(|p| p.shot) else { return Ok(()) };
        near.push_back(Arc::new(Line::new(shot, points, shots)));
        pass(&mut near, shot.into())
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
    pass(&mut near, u64::MAX)
}
