//! In: the points of a scan and a measured pose. Out: how well the points agree with the drawing there, how much of the
//! part was seen, and which of its alike turns it has.
//! Frame and unit: part frame, mm.

use crate::fault::Gate;
use crate::find::measure::options::MeasureOptions;
use crate::find::measure::points::{Ordered, localise};
use crate::find::measure::pose::Measured;
use crate::find::measure::surface_ends::Observation;
use crate::find::model::drawing::Drawing;
use crate::find::model::edge_index::EdgeIndex;
use crate::find::model::face::Face;
use crate::geometry::{Base, Part, Rigid, Vec3};
use std::collections::HashSet;

/// How well the points agree with a pose.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Agreement {
    /// Share of the points inside surfaces that lie on them.
    pub on_surface: f64,
    /// Number of points inside surfaces, excluding those near edges.
    pub surface_points: usize,
    /// Share of the points in holes and beside the part that do not lie on a surface.
    pub beside: f64,
    /// Number of points in holes and beside the part, excluding those near edges.
    pub beside_points: usize,
    /// The smaller of `on_surface` and `beside`.
    pub agreement: f64,
    /// Share of the drawn surfaces (in squares of 0.6 units of the recipe) on which points were seen.
    pub coverage: f64,
    /// Share of the drawn edges (in pieces of 0.5 units of the recipe) at which a surface was seen to end.
    pub edges: f64,
    /// Share of the drawn edges beyond which the surface continues, as on another, larger part.
    pub crossed: f64,
}

/// Lengths that the judgement uses, scaled by the recipe's unit.
#[derive(Clone, Copy)]
struct Lengths {
    /// Points closer than this to an edge do not count for or against a surface, mm.
    margin: f64,
    /// The same margin where turns are distinguished, mm.
    turn_margin: f64,
    /// Width of the ring around the part in which points are counted, mm.
    ring: f64,
    square: f64,
    piece: f64,
}

impl Lengths {
    fn of(options: &MeasureOptions) -> Lengths {
        let at = |mm: f64| mm * options.unit();
        Lengths { margin: at(0.4), turn_margin: at(0.3), ring: at(1.2), square: at(0.6), piece: at(0.5) }
    }
}

/// A drawing, prepared for counting points against it.
struct Drawn<'a> {
    faces: Vec<Face>,
    edges: EdgeIndex,
    bounds: [f64; 4],
    lengths: Lengths,
    options: &'a MeasureOptions,
}

/// Counts of points, and the places at which they lie.
#[derive(Default)]
struct Tally {
    /// Points inside surfaces, and those of them that lie on one.
    inside: usize,
    on: usize,
    /// Points in holes and beside the part, and those of them that lie on no surface.
    beside: usize,
    clear: usize,
    /// Squares in which a surface was seen.
    seen: HashSet<(i32, i32)>,
    /// Pieces of edges beyond which a surface continues.
    crossed: HashSet<(i32, i32, usize)>,
}

/// Judges a pose.
pub fn judge(points: &Ordered, drawing: &Drawing, measured: &Measured, options: &MeasureOptions) -> Agreement {
    judge_inside(points, drawing, measured, options, &|_, _| true)
}

/// Judges a pose by the places (x and y of the part) that were scanned, as `inside` states; other places are ignored.
pub(super) fn judge_inside(
    points: &Ordered,
    drawing: &Drawing,
    measured: &Measured,
    options: &MeasureOptions,
    inside: &dyn Fn(f64, f64) -> bool,
) -> Agreement {
    let drawn = Drawn {
        faces: drawing.faces(),
        edges: EdgeIndex::new(drawing, options.unit()),
        bounds: drawing.bounds(),
        lengths: Lengths::of(options),
        options,
    };
    let tally = drawn.count(&localise(points, drawing, &measured.base_from_part, options));
    let scanned = drawn.edges.samples().iter().filter(|s| inside(s.x, s.y));
    let pieces: HashSet<_> = scanned.map(|s| drawn.piece(s.x, s.y, s.shape)).collect();
    let share = |n: usize, of: usize| if of == 0 { 0.0 } else { n as f64 / of as f64 };
    let on_surface = share(tally.on, tally.inside);
    // Without any point beside the part, nothing contradicts the pose there.
    let free = if tally.beside == 0 { 1.0 } else { share(tally.clear, tally.beside) };
    let (covered, squares) = drawn.covered(&tally.seen, inside);
    Agreement {
        on_surface,
        surface_points: tally.inside,
        beside: free,
        beside_points: tally.beside,
        agreement: on_surface.min(free),
        coverage: share(covered, squares),
        edges: share(drawn.ended(&measured.observations).intersection(&pieces).count(), pieces.len()),
        crossed: share(tally.crossed.intersection(&pieces).count(), pieces.len()),
    }
}

impl Drawn<'_> {
    fn square(&self, x: f64, y: f64) -> (i32, i32) {
        let side = self.lengths.square;
        ((x / side).floor() as i32, (y / side).floor() as i32)
    }

    fn piece(&self, x: f64, y: f64, shape: usize) -> (i32, i32, usize) {
        let side = self.lengths.piece;
        ((x / side).floor() as i32, (y / side).floor() as i32, shape)
    }

    /// Counts points at and around the part by what the drawing has there. Those near edges only show that a surface
    /// was seen.
    fn count(&self, local: &[Option<Vec3>]) -> Tally {
        let mut t = Tally::default();
        let (b, Lengths { margin, ring, .. }) = (self.bounds, self.lengths);
        for q in local.iter().flatten() {
            if q.x < b[0] - ring || q.x > b[2] + ring || q.y < b[1] - ring || q.y > b[3] + ring {
                continue;
            }
            let at = |f: &Face| (q.z - f.z).abs() <= self.options.height_gate_mm;
            let here: Vec<&Face> = self.faces.iter().filter(|f| f.material(q.x, q.y)).collect();
            let on = here.iter().any(|f| at(f));
            if on {
                t.seen.insert(self.square(q.x, q.y));
            }
            if self.edges.nearest(q.x, q.y, margin, |_| true).is_some() {
                continue;
            }
            if !here.is_empty() {
                t.inside += 1;
                t.on += usize::from(on);
                continue;
            }
            t.beside += 1;
            t.clear += usize::from(!self.faces.iter().any(at));
            for f in self.faces.iter().filter(|f| at(f)) {
                if let Some(s) = self.edges.nearest(q.x, q.y, ring, |s| s.z == f.z && s.locates) {
                    t.crossed.insert(self.piece(s.x, s.y, s.shape));
                }
            }
        }
        t
    }

    /// Number of squares of the drawn surfaces that were seen, and number of all their squares.
    fn covered(&self, seen: &HashSet<(i32, i32)>, inside: &dyn Fn(f64, f64) -> bool) -> (usize, usize) {
        let (b, square) = (self.bounds, self.lengths.square);
        let ((x0, y0), (x1, y1)) = (self.square(b[0], b[1]), self.square(b[2], b[3]));
        let (mut drawn, mut covered) = (0usize, 0usize);
        for cy in y0..=y1 {
            for cx in x0..=x1 {
                let (x, y) = ((f64::from(cx) + 0.5) * square, (f64::from(cy) + 0.5) * square);
                if inside(x, y) && self.faces.iter().any(|f| f.material(x, y)) {
                    drawn += 1;
                    covered += usize::from(seen.contains(&(cx, cy)));
                }
            }
        }
        (covered, drawn)
    }

    /// Pieces of the drawn edges at which a surface was seen to end.
    fn ended(&self, observations: &[Observation]) -> HashSet<(i32, i32, usize)> {
        // Uses the drawing's own sample: an edge may lie on the border of two pieces, where rounding decides.
        let sample = |o: &Observation| {
            let (x, y) = (o.x - o.residual * o.nx, o.y - o.residual * o.ny);
            self.edges.nearest(x, y, self.lengths.piece, |s| (s.shape, s.element) == (o.shape, o.element))
        };
        let ends = observations.iter().filter(|o| o.weight > 0.0).filter_map(sample);
        ends.map(|s| self.piece(s.x, s.y, s.shape)).collect()
    }
}

/// Votes for one turn of the part against another.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct TurnVote {
    /// Turn of the rival, degrees.
    pub rival_deg: f64,
    /// Number of points that speak for the pose, among those where the two differ.
    pub votes_for: usize,
    /// Number of points that speak for the rival.
    pub votes_against: usize,
}

impl TurnVote {
    /// Least number of votes for a decision, and the share of them that decides.
    const LEAST: usize = 6;
    const SHARE: f64 = 0.8;

    fn all(&self) -> usize {
        self.votes_for + self.votes_against
    }

    fn share(&self) -> f64 {
        self.votes_for as f64 / self.all().max(1) as f64
    }

    /// `Some(true)`: the pose is right; `Some(false)`: the rival is; `None`: undecided.
    pub fn told(&self) -> Option<bool> {
        match self.share() {
            _ if self.all() < Self::LEAST => None,
            share if share >= Self::SHARE => Some(true),
            share if share <= 1.0 - Self::SHARE => Some(false),
            _ => None,
        }
    }

    /// The gate on the turn: the number of votes if they are too few, otherwise the share for the pose.
    pub fn gate(&self) -> Gate {
        let (name, value, limit) = if self.all() < Self::LEAST {
            ("points that tell the turn", self.all() as f64, Self::LEAST as f64)
        } else {
            ("turn told", self.share(), Self::SHARE)
        };
        Gate { name, value, limit, passed: self.told() == Some(true) }
    }
}

/// For each alike turn, counts the points that fit the part or the turned part, where the two differ.
pub fn vote(
    points: &Ordered,
    drawing: &Drawing,
    pose: &Rigid<Base, Part>,
    turns: u32,
    options: &MeasureOptions,
) -> Vec<TurnVote> {
    let (margin, gate) = (Lengths::of(options).turn_margin, options.height_gate_mm);
    let faces = drawing.faces();
    let edges = EdgeIndex::new(drawing, options.unit());
    let local = localise(points, drawing, pose, options);
    (1..turns)
        .map(|k| {
            let angle = std::f64::consts::TAU * f64::from(k) / f64::from(turns);
            let back: Rigid<Part, Part> = Rigid::from_vectors(&Vec3::new(0.0, 0.0, -angle), Vec3::zeros());
            let mut out = TurnVote { rival_deg: angle.to_degrees(), votes_for: 0, votes_against: 0 };
            for q in local.iter().flatten() {
                let r = back.point(q);
                for f in &faces {
                    let (mine, theirs) = (f.material(q.x, q.y), f.material(r.x, r.y));
                    let near = |p: &Vec3| edges.nearest(p.x, p.y, margin, |s| s.z == f.z).is_some();
                    if mine == theirs || near(q) || near(&r) {
                        continue;
                    }
                    let on = (q.z - f.z).abs() <= gate;
                    // A point above the surface belongs to something that lies on it: no vote.
                    if !on && q.z > f.z {
                        continue;
                    }
                    if on == mine {
                        out.votes_for += 1;
                    } else {
                        out.votes_against += 1;
                    }
                }
            }
            out
        })
        .collect()
}
