//! In: slope fields of one pyramid level and a shape model turned and scaled. Out: places where many of
//! the model's directions are met within a few pixels (quantised and spread as in \[hinterstoisser12\]).
//! Frame and unit: pixels of that level; scores are integers, 0 to 4 a feature.

use super::accelerator::Accelerator;
use super::level::{Level, Placed};
use crate::find::model::shape_model::{ModelPoint, thin};
use crate::stages::shape::frame::{BINS, STRIDE};
use crate::stages::shape::sums::Peak;

/// Score of a perfect feature. 63 features of 4 fill an 8-bit sum.
pub const FULL: u8 = 4;
/// Most features of a model that enter a sum.
pub const MAX_FEATURES: usize = 63;

/// Index of the nearest of 16 directions.
pub fn bin(gx: f64, gy: f64) -> usize {
    let turn = gy.atan2(gx) / std::f64::consts::TAU * BINS as f64;
    turn.round().rem_euclid(BINS as f64) as usize % BINS
}

/// A hit of the coarse search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Column, px of the level.
    pub x: f64,
    /// Row, px of the level.
    pub y: f64,
    /// Index into [`Query::turns`].
    pub pose: usize,
    /// Share of the full score, 0 to 1.
    pub score: f32,
}

/// A turn (rad) and scale to be tried.
#[derive(Clone, Copy, Debug)]
pub struct Turn {
    /// About the model's reference point, x towards y, rad.
    pub angle: f64,
    /// Factor on the model's size.
    pub scale: f64,
}

/// What is searched on a level.
#[derive(Clone, Copy, Debug)]
pub struct Query<'a> {
    /// Edge points of the level, in px of level 0.
    pub model: &'a [ModelPoint],
    /// Every turn and scale to be tried.
    pub turns: &'a [Turn],
    /// Pixels of level 0 in one of this level.
    pub px: f64,
    /// Least share of the full score.
    pub limit: f32,
    /// Most hits; none lies within one place and `apart` rad of a better one.
    pub most: usize,
    /// Hits at one place whose turns differ by less than this count as one, rad.
    pub apart: f64,
}

impl Level {
    /// Hits above the limit, best first; the same on the GPU and on the CPU.
    pub fn search(&self, query: &Query, accelerator: Option<&Accelerator>) -> Vec<Hit> {
        let features = thin(query.model, 1.5 * query.px, MAX_FEATURES);
        let placed: Vec<Vec<Placed>> = query.turns.iter().map(|t| self.place(&features, t, query.px)).collect();
        let full = (placed.first().map_or(0, Vec::len) * FULL as usize).max(1) as f32;
        let least = ((query.limit * full).ceil() as u8).max(1);
        // If an adapter fails, or its list overflows, the CPU does the work.
        let found = accelerator
            .filter(|a| a.pays(&self.frame, &placed))
            .and_then(|a| a.peaks(self, &placed, least).ok().flatten())
            .unwrap_or_else(|| self.peaks(&placed, least));
        self.select(&found, query, full)
    }

    fn place(&self, features: &[ModelPoint], turn: &Turn, px: f64) -> Vec<Placed> {
        let (s, c) = turn.angle.sin_cos();
        let half = STRIDE as i64 / 2;
        let one = |f: &ModelPoint| {
            let layer = self.kinds.iter().position(|k| *k == f.kind)?;
            let (fx, fy) = (f.x * turn.scale / px, f.y * turn.scale / px);
            Some(Placed {
                layer,
                want: bin(c * f.gx - s * f.gy, s * f.gx + c * f.gy),
                dx: (c * fx - s * fy).round() as i64 + half,
                dy: (s * fx + c * fy).round() as i64 + half,
            })
        };
        features.iter().filter_map(one).collect()
    }

    fn select(&self, peaks: &[Peak], query: &Query, full: f32) -> Vec<Hit> {
        let place = |k: u32| (k as usize * STRIDE + STRIDE / 2) as f64 - f64::from(self.frame.margin) - 0.5;
        let mut hits: Vec<Hit> = peaks
            .iter()
            .map(|p| Hit { x: place(p.column), y: place(p.row), pose: p.turn as usize, score: p.sum as f32 / full })
            .collect();
        hits.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.pose.cmp(&b.pose)));
        let turns = query.turns;
        let mut kept: Vec<Hit> = Vec::new();
        for h in hits {
            let reach = STRIDE as f64 + 0.5;
            let taken = kept.iter().any(|k| {
                (k.x - h.x).abs() < reach
                    && (k.y - h.y).abs() < reach
                    && turn_between(turns[k.pose].angle, turns[h.pose].angle) < query.apart
                    && (turns[k.pose].scale / turns[h.pose].scale).ln().abs() < 0.05
            });
            if !taken {
                kept.push(h);
                if kept.len() == query.most {
                    break;
                }
            }
        }
        kept
    }
}

/// Smallest angle between two directions, rad.
pub fn turn_between(a: f64, b: f64) -> f64 {
    let d = (a - b).rem_euclid(std::f64::consts::TAU);
    d.min(std::f64::consts::TAU - d)
}
