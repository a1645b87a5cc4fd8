//! In: a cloud, shot by shot. Out: each shot's line with two quantities for each of its points: the light that the
//! shots before and after show at the same place along the stripe, and how far the point moves along its ray when the
//! sheet moves.
//! Frame and unit: the cloud's frame, mm; docs/math.md, Sheets that are thick (1) to (3).

use crate::fault::Result;
use crate::geometry::{Base, Plane, Vec3};
use crate::scan::{Along, CloudPoint, PointSource, Shots};
use rayon::prelude::*;
use std::collections::VecDeque;
use std::sync::Arc;

/// Points of another line count as neighbours up to this many pixels along the stripe, closer ones with more weight.
const BESIDE_PX: f64 = 1.5;
/// Least stripe width, px, for narrower or unmeasured stripes: centres on one surface differ by less than a pixel.
const LEAST_PX: f32 = 1.0;
/// Shots on either side whose light counts: as many as lie within twice the stripe's width, within these limits. A
/// second shot on either side tells a bar of print from an edge.
const FEWEST: usize = 2;
const MOST: usize = 12;
/// Points of a line that lie this far apart along the image axis, px, are next to each other.
const NEXT_PX: std::ops::Range<f32> = 0.5..1.5;

/// Light of one shot at a point's place along the stripe.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beside {
    /// Distance of the shot's sheet from the point along the sheet's normal, mm.
    pub at: f64,
    /// Light relative to the point's own; 0 where the shot has no point near.
    pub light: f64,
}

/// What the shots around it show about a point.
#[derive(Clone, Debug, Default)]
pub(super) struct Pull {
    /// The light of these shots and of the point's own, in their order; empty if none is known.
    pub lights: Vec<Beside>,
    /// Displacement of the point if the middle of its light lies 1 mm off the sheet's.
    pub per: Vec3,
}

/// A shot's points.
pub(super) struct Line {
    pub shot: u32,
    pub points: Vec<CloudPoint>,
    /// Logarithms of the points' intensity.
    lights: Vec<f64>,
    /// Pinhole, sheet and scale at the shot, if its pose is known.
    place: Option<Place>,
    /// Indices of the points in their order along the stripe, with their positions there, px.
    order: Vec<(f64, u32)>,
    along: Along,
    /// Distance across the stripe at which a neighbour's weight is halved, px.
    width_px: f32,
}

/// Pinhole and sheet of a shot.
struct Place {
    eye: Vec3,
    sheet: Plane<Base>,
    /// Direction along the stripe.
    along: Vec3,
    /// Distance between neighbouring points along it, mm.
    pixel_mm: f64,
}

/// A line, and what its neighbours show about its points, one entry a point.
pub(super) struct Pulled {
    pub line: Arc<Line>,
    pub pulls: Vec<Pull>,
    /// Shots to those with which this one is compared: about half a stripe's width. Closer ones are shifted alike.
    pub stride: u32,
}

/// The largest such stride.
pub(super) const FARTHEST: usize = MOST / 4;

/// Position of a point along its stripe and across it, px.
fn in_picture(along: Along, p: &CloudPoint) -> (f32, f32) {
    if along == Along::U { (p.u, p.v) } else { (p.v, p.u) }
}

fn light(p: &CloudPoint) -> f64 {
    f64::from(p.intensity.max(f32::MIN_POSITIVE)).ln()
}

impl Place {
    /// `None` if the shot's pose or the sheet is not known, or if no two points lie beside each other.
    fn of(shot: u32, points: &[CloudPoint], shots: &Shots) -> Option<Place> {
        let (place, sheet) = shots.place(shot).zip(shots.sheet)?;
        let normal = place.direction(&sheet.normal);
        let on = place.point(&(sheet.normal * sheet.offset));
        let along = normal.cross(&place.direction(&Vec3::z())).try_normalize(1e-9)?;
        let mut order: Vec<(f32, f64)> =
            points.iter().map(|p| (in_picture(shots.along, p).0, p.at().dot(&along))).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let next = order.windows(2).filter(|w| NEXT_PX.contains(&(w[1].0 - w[0].0)));
        let mut apart: Vec<f64> = next.map(|w| ((w[1].1 - w[0].1) / f64::from(w[1].0 - w[0].0)).abs()).collect();
        apart.sort_by(f64::total_cmp);
        let pixel_mm = *apart.get(apart.len() / 2)?;
        let sheet = Plane::new(normal, normal.dot(&on))?;
        (pixel_mm > 0.0).then(|| Place { eye: place.point(&Vec3::zeros()), sheet, along, pixel_mm })
    }
}

impl Line {
    fn new(shot: u32, points: Vec<CloudPoint>, shots: &Shots) -> Line {
        let place = Place::of(shot, &points, shots);
        let mut order: Vec<(f64, u32)> = match &place {
            Some(place) => points.iter().zip(0..).map(|(p, i)| (place.position(p), i)).collect(),
            None => Vec::new(),
        };
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let lights = points.iter().map(light).collect();
        let width_px = shots.stripe_px.unwrap_or(0.0).max(LEAST_PX);
        Line { shot, points, lights, place, order, along: shots.along, width_px }
    }

    /// Width of the stripe on the surface, mm (1 sigma): the sheet is no thicker.
    pub fn width_mm(&self) -> Option<f64> {
        self.place.as_ref().map(|place| f64::from(self.width_px) * place.pixel_mm)
    }

    /// This line's points that are neighbours of a point of another line: index, distances along and across the
    /// stripe, px. Along the stripe the places on the surface count: under a slanted stripe the next shot shows the
    /// same place some columns beside.
    fn beside(&self, p: &CloudPoint) -> impl Iterator<Item = (usize, f64, f64)> + '_ {
        let along = self.place.as_ref().map_or(0.0, |place| place.position(p));
        let across = in_picture(self.along, p).1;
        let first = self.order.partition_point(|(a, _)| *a <= along - BESIDE_PX);
        let near = self.order[first..].iter().take_while(move |(a, _)| *a < along + BESIDE_PX);
        near.map(move |(a, i)| {
            let i = *i as usize;
            (i, (a - along).abs(), f64::from((in_picture(self.along, &self.points[i]).1 - across).abs()))
        })
    }

    /// This line's point that is nearest to a point of another line.
    pub fn nearest(&self, p: &CloudPoint) -> Option<usize> {
        let square = |(_, along, across): &(usize, f64, f64)| along * along + across * across;
        self.beside(p).min_by(|a, b| square(a).total_cmp(&square(b))).map(|(i, _, _)| i)
    }

    /// Logarithm of the light next to a point of another line, and the weight of the points found there, 0..=1. The
    /// mean's weights are continuous, so that small shifts of this line's points do not cause jumps. Points several
    /// stripe widths away across it are of another surface and count little.
    fn light(&self, p: &CloudPoint) -> (f64, f64) {
        let (mut sum, mut sure, mut all) = (0.0, 0.0, 0.0);
        for (i, along, across) in self.beside(p) {
            let weight = (1.0 - along / BESIDE_PX) / (1.0 + (across / f64::from(self.width_px)).powi(2));
            // A fit that determines its position poorly determines its intensity poorly too.
            let known = weight / f64::from(self.points[i].sigma_mm.max(1e-6)).powi(2);
            sum += known * self.lights[i];
            sure += known;
            all += weight;
        }
        if sure > 0.0 { (sum / sure, all.min(1.0)) } else { (0.0, 0.0) }
    }

    /// What the lines around it, itself among them, show about a point of this one. Where a shot has no point near, the
    /// surface ends, or is dark or hidden: its light is 0.
    fn pull(&self, i: usize, around: &[Arc<Line>]) -> Pull {
        let Some(Place { eye, sheet, .. }) = &self.place else { return Pull::default() };
        let p = &self.points[i];
        let (at, here) = (p.at(), self.light(p).0);
        let beside = |line: &Arc<Line>| {
            let place = line.place.as_ref()?;
            let (light, weight) = line.light(p);
            Some(Beside { at: -place.sheet.distance(&at), light: weight * (light - here).exp() })
        };
        let mut lights: Vec<Beside> = around.iter().filter_map(beside).collect();
        lights.sort_by(|a, b| a.at.total_cmp(&b.at));
        let ray = at - eye;
        let per = ray / ray.dot(&sheet.normal);
        let known = per.iter().all(|x| x.is_finite()) && lights.iter().all(|l| l.at.is_finite() && l.light.is_finite());
        if known { Pull { lights, per } } else { Pull::default() }
    }

    /// Shots on either side that show the reflectance within twice the stripe's width.
    fn reach(&self, around: &[Arc<Line>]) -> u32 {
        let on_sheet = |line: &Line| line.place.as_ref().map(|p| (line.shot, p.sheet.distance(&self.points[0].at())));
        let apart = around.windows(2).filter_map(|w| Some((on_sheet(&w[0])?, on_sheet(&w[1])?)));
        let mut steps: Vec<f64> = apart.map(|(a, b)| (b.1 - a.1).abs() / f64::from(b.0.abs_diff(a.0))).collect();
        steps.sort_by(f64::total_cmp);
        let step = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
        // Not a number without a step: then the limit.
        let count = (2.0 * self.width_mm().unwrap_or(0.0) / step).ceil();
        (count.min(MOST as f64) as usize).max(FEWEST) as u32
    }

    fn pulled(self: &Arc<Line>, around: &[Arc<Line>]) -> Pulled {
        let reach = self.reach(around);
        let first = around.partition_point(|line| line.shot + reach < self.shot);
        let last = around.partition_point(|line| line.shot <= self.shot + reach);
        let near = &around[first..last];
        let pulls = (0..self.points.len()).into_par_iter().with_min_len(64).map(|i| self.pull(i, near)).collect();
        Pulled { line: self.clone(), pulls, stride: (reach / 4).max(1) }
    }
}

impl Place {
    /// Position of a point along the stripe, px.
    fn position(&self, p: &CloudPoint) -> f64 {
        p.at().dot(&self.along) / self.pixel_mm
    }
}

/// Passes the lines of a cloud, whose points come in the order of their shots, to `take` in that order.
pub(super) fn lines(cloud: &dyn PointSource, shots: &Shots, take: &mut dyn FnMut(Pulled) -> Result<()>) -> Result<()> {
    // The lines before and after the next one that is passed on, which is the one of this index.
    let (mut around, mut next) = (VecDeque::<Arc<Line>>::new(), 0);
    let mut points: Vec<CloudPoint> = Vec::new();
    let mut pass = |around: &mut VecDeque<Arc<Line>>, next: &mut usize| -> Result<()> {
        let all = around.make_contiguous();
        let line = all[*next].clone();
        take(line.pulled(all))?;
        *next += 1;
        if *next > MOST {
            around.pop_front();
            *next -= 1;
        }
        Ok(())
    };
    let mut closed = Ok(());
    cloud.for_each_chunk(&mut |chunk| {
        for line in chunk.chunk_by(|a, b| a.shot == b.shot) {
            if points.first().is_some_and(|p| p.shot != line[0].shot) {
                let done = std::mem::take(&mut points);
                around.push_back(Arc::new(Line::new(done[0].shot, done, shots)));
                if closed.is_ok() && around.len() > next + MOST {
                    closed = pass(&mut around, &mut next);
                }
            }
            points.extend_from_slice(line);
        }
    })?;
    closed?;
    if let Some(shot) = points.first().map(|p| p.shot) {
        around.push_back(Arc::new(Line::new(shot, points, shots)));
    }
    while next < around.len() {
        pass(&mut around, &mut next)?;
    }
    Ok(())
}
