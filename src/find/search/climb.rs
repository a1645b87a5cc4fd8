//! In: the directions of one pyramid level, a model's points there and a pose. Out: how well they agree, and the best
//! pose around it, by steps of one cell and of a corresponding turn.
//! Frame and unit: pixels of the scene in poses, cells of the level inside; scores from 0 to 1.

use super::options::SearchOptions;
use super::refine::Pose;
use crate::find::model::gradient::Field;
use crate::find::model::shape_model::ModelPoint;
use crate::find::scene::{Kind, to_level};
use glam::Vec2;
use rayon::prelude::*;

/// Directions of a level, unit length; 0 where weak or unseen.
pub(in crate::find) struct Directions {
    pub kind: Kind,
    pub field: Field,
    pub threshold: f32,
    ux: Vec<f32>,
    uy: Vec<f32>,
    /// False where every cell except those at the border is seen.
    pub gaps: bool,
}

/// Cells at the border of a complete layer that have no slope.
const BORDER: i64 = 2;

impl Directions {
    pub fn new(kind: Kind, field: Field, threshold: f32) -> Directions {
        // Squares instead of hypot: the squares of slopes stay well within the range of f32.
        let least = threshold * threshold;
        let (mut ux, mut uy) = (vec![0f32; field.gx.len()], vec![0f32; field.gx.len()]);
        let out = ux.par_chunks_mut(field.width).zip(uy.par_chunks_mut(field.width));
        let slopes = field.gx.par_chunks(field.width).zip(field.gy.par_chunks(field.width));
        out.zip(slopes).for_each(|((ux, uy), (gx, gy))| {
            for ((ux, uy), (gx, gy)) in ux.iter_mut().zip(uy).zip(gx.iter().zip(gy)) {
                let square = gx * gx + gy * gy;
                let k = if square > least && square > 0.0 { 1.0 / square.sqrt() } else { 0.0 };
                (*ux, *uy) = (gx * k, gy * k);
            }
        });
        let inner = |y: usize| y >= BORDER as usize && y + (BORDER as usize) < field.height;
        let gaps = field.width < 5
            || field.seen.par_chunks(field.width).enumerate().any(|(y, row)| {
                inner(y) && row[BORDER as usize..field.width - BORDER as usize].iter().any(|seen| !seen)
            });
        Directions { kind, field, threshold, ux, uy, gaps }
    }
}

#[derive(Clone, Copy, Debug)]
pub(in crate::find) struct Candidate {
    pub pose: Pose,
    pub score: f64,
}

/// Mean cosine between the model and the nearest cells of a level, and the share of places seen. A place on a missing
/// cell counts as half a miss: a shadow gives no information about an edge, but a pose that needs many shadows is the
/// worse explanation. A place outside the scene or without contrast is a full miss.
pub(in crate::find) fn score(
    layers: &[Directions],
    points: &[ModelPoint],
    level: usize,
    pose: &Pose,
    ignore: bool,
) -> (f64, f64) {
    let around = Around::<1, 1>::new(layers, points, level, pose, ignore);
    (around.score(0, 0), f64::from(around.seen[0][0]) / points.len() as f64)
}

/// The sums of one pose for ROWS x LANES shifts by whole cells around it. The model is turned once for all of them and
/// neighbouring cells are read side by side; LANES beyond ROWS only fill a vector register.
struct Around<const ROWS: usize, const LANES: usize> {
    sum: [[f32; LANES]; ROWS],
    missing: [[f32; LANES]; ROWS],
    seen: [[f32; LANES]; ROWS],
    points: f32,
}

impl<const ROWS: usize, const LANES: usize> Around<ROWS, LANES> {
    fn new(layers: &[Directions], points: &[ModelPoint], level: usize, pose: &Pose, ignore: bool) -> Self {
        let (s, c) = pose.angle.sin_cos();
        let reach = (ROWS / 2) as i64;
        // The nearest cell, for the shift with the smallest row and column.
        let first = 0.5 - reach as f64;
        let (cx, cy) = (to_level(pose.x, level) + first, to_level(pose.y, level) + first);
        let k = pose.scale / (1u64 << level) as f64;
        let mut out = Around {
            sum: [[0.0; LANES]; ROWS],
            missing: [[0.0; LANES]; ROWS],
            seen: [[0.0; LANES]; ROWS],
            points: points.len() as f32,
        };
        for p in points {
            let ix = (cx + k * (c * p.x - s * p.y)).floor() as i64;
            let iy = (cy + k * (s * p.x + c * p.y)).floor() as i64;
            let g = Vec2::new((c * p.gx - s * p.gy) as f32, (s * p.gx + c * p.gy) as f32);
            let either = ignore || p.either;
            for d in layers.iter().filter(|d| d.kind == p.kind) {
                let (w, h) = (d.field.width as i64, d.field.height as i64);
                let edge = if d.gaps { 0 } else { BORDER };
                let inside =
                    ix >= edge && iy >= edge && ix + (LANES as i64) + edge <= w && iy + (ROWS as i64) + edge <= h;
                for r in 0..ROWS {
                    if inside {
                        out.row(d, r, ((iy + r as i64) * w + ix) as usize, g, either);
                        continue;
                    }
                    for l in 0..LANES {
                        let (x, y) = (ix + l as i64, iy + r as i64);
                        if (0..w).contains(&x) && (0..h).contains(&y) {
                            out.cell(d, r, l, (y * w + x) as usize, g, either);
                        }
                    }
                }
            }
        }
        out
    }

    fn row(&mut self, d: &Directions, r: usize, i: usize, g: Vec2, either: bool) {
        let ux: &[f32; LANES] = d.ux[i..i + LANES].try_into().expect("so long");
        let uy: &[f32; LANES] = d.uy[i..i + LANES].try_into().expect("so long");
        let mut dot: [f32; LANES] = std::array::from_fn(|l| ux[l] * g.x + uy[l] * g.y);
        if either {
            dot = dot.map(f32::abs);
        }
        for (sum, dot) in self.sum[r].iter_mut().zip(dot) {
            *sum += dot;
        }
        if d.gaps {
            for (l, seen) in d.field.seen[i..i + LANES].iter().enumerate() {
                self.seen[r][l] += f32::from(u8::from(*seen));
                self.missing[r][l] += f32::from(u8::from(!*seen));
            }
        } else {
            self.seen[r].iter_mut().for_each(|seen| *seen += 1.0);
        }
    }

    fn cell(&mut self, d: &Directions, r: usize, l: usize, i: usize, g: Vec2, either: bool) {
        let dot = d.ux[i] * g.x + d.uy[i] * g.y;
        self.sum[r][l] += if either { dot.abs() } else { dot };
        *(if d.field.seen[i] { &mut self.seen[r][l] } else { &mut self.missing[r][l] }) += 1.0;
    }

    fn score(&self, r: usize, l: usize) -> f64 {
        f64::from(self.sum[r][l] / (self.points - 0.5 * self.missing[r][l]))
    }

    /// The best of the shifts, moved by whole cells of `px`.
    fn best(&self, pose: &Pose, px: f64) -> Candidate {
        let mut best = Candidate { pose: *pose, score: f64::MIN };
        for r in 0..ROWS {
            for l in 0..ROWS {
                let score = self.score(r, l);
                if score > best.score {
                    let by = |k: usize| (k as f64 - (ROWS / 2) as f64) * px;
                    best = Candidate { pose: Pose { x: pose.x + by(l), y: pose.y + by(r), ..*pose }, score };
                }
            }
        }
        best
    }
}

/// Other local maxima near a pose, at its turn, by whole cells. Beside a step of height lies a shadow, whose cells
/// count half. A pose that is off by the width of a shadow is therefore a local maximum, and climbing from the coarser
/// level may end there.
pub(in crate::find) fn hills(
    layers: &[Directions],
    points: &[ModelPoint],
    level: usize,
    from: &Candidate,
    ignore: bool,
) -> Vec<Candidate> {
    /// Half width of the area, cells, and its width.
    const REACH: usize = 6;
    const WIDTH: usize = 2 * REACH + 1;
    let around = Around::<WIDTH, 16>::new(layers, points, level, &from.pose, ignore);
    let px = (1u64 << level) as f64;
    let mut out = Vec::new();
    for r in 1..WIDTH - 1 {
        for l in (1..WIDTH - 1).filter(|&l| (r, l) != (REACH, REACH)) {
            let score = around.score(r, l);
            let top = (r - 1..=r + 1).all(|r| (l - 1..=l + 1).all(|l| around.score(r, l) <= score));
            if top {
                let by = |k: usize| (k as f64 - REACH as f64) * px;
                let pose = Pose { x: from.pose.x + by(l), y: from.pose.y + by(r), ..from.pose };
                out.push(Candidate { pose, score });
            }
        }
    }
    out
}

/// Climbs to the best pose around a candidate.
pub(in crate::find) fn climb(
    layers: &[Directions],
    points: &[ModelPoint],
    level: usize,
    from: Candidate,
    radius: f64,
    options: &SearchOptions,
    first: bool,
) -> Candidate {
    const ROUNDS: usize = 12;
    let px = (1u64 << level) as f64;
    let turn = 1.0 / (from.pose.scale * radius / px).max(4.0);
    let ignore = options.ignore_polarity;
    let turned = |pose: &Pose, by: i32| Pose { angle: pose.angle + f64::from(by) * turn, ..*pose };
    // Steps out of the range are not taken.
    let turns = |from: &Pose| {
        let from = *from;
        (-1..=1).map(move |by| turned(&from, by)).filter(|pose| options.holds_angle(pose.angle, 1e-9))
    };
    let mut best = Candidate { score: score(layers, points, level, &from.pose, ignore).0, pose: from.pose };
    if first {
        // The coarse grid is STRIDE px wide and the turns are as far apart: a wider neighbourhood is searched once.
        for pose in turns(&from.pose) {
            let found = Around::<5, 8>::new(layers, points, level, &pose, ignore).best(&pose, px);
            if found.score > best.score {
                best = found;
            }
        }
    }
    for _ in 0..ROUNDS {
        let start = best;
        for pose in turns(&start.pose) {
            let found = Around::<3, 4>::new(layers, points, level, &pose, ignore).best(&pose, px);
            if found.score > best.score {
                best = found;
            }
        }
        if options.scales[1] > options.scales[0] {
            for by in [-1.0, 1.0] {
                let mut pose = best.pose;
                pose.scale = (pose.scale * (1.0 + by * turn)).clamp(options.scales[0], options.scales[1]);
                let score = score(layers, points, level, &pose, ignore).0;
                if score > best.score {
                    best = Candidate { pose, score };
                }
            }
        }
        if best.score <= start.score {
            break;
        }
    }
    best
}
