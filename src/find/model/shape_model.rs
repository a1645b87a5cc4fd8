//! In: a region of a scene, or a drawing. Out: a shape model: edge points with the direction of their contrast, one
//! list for each pyramid level.
//! Frame and unit: pixels of level 0 about the model's reference point; x right, y down the rows.

use super::drawing::Drawing;
use super::gradient::{Field, slopes};
use crate::fault::{Fault, Result};
use crate::find::scene::{Kind, Region, Scene, from_level};

/// An edge point: its position, and the unit direction in which values rise.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ModelPoint {
    /// Right of the reference point, px of level 0.
    pub x: f64,
    /// Below the reference point, px of level 0.
    pub y: f64,
    /// x of the direction in which values rise.
    pub gx: f64,
    /// y of the direction in which values rise.
    pub gy: f64,
    /// Kind of the layer in which the edge is searched.
    pub kind: Kind,
    /// True where the direction of contrast is unknown: rising and falling both fit.
    pub either: bool,
}

/// A shape to be found.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ShapeModel {
    /// Edge points of each pyramid level, all in pixels of level 0.
    pub levels: Vec<Vec<ModelPoint>>,
    /// Largest distance of an edge from the reference point, px.
    pub radius: f64,
    /// Half width and half height of the box around the edges, px.
    pub half_size: [f64; 2],
    /// Centre of that box from the reference point, px.
    pub centre: [f64; 2],
    /// How many edge points of level 0 together hold the information of a single one, 1 or more. Neighbours along an
    /// edge see the same noise, and layers that show the same edge add little.
    pub redundancy: f64,
}

/// How a model is made.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ModelOptions {
    /// Weakest edge of a region that is used, as a share of its 95th percentile, 0.02 to 1. A low value includes
    /// texture, a high one excludes weak outlines.
    pub contrast: f64,
    /// Most edge points on a level, 30 to 5000. More are slower and a little more precise.
    pub max_points: usize,
    /// Most pyramid levels, 1 to 8. Fewer are slower and lose less detail.
    pub max_levels: usize,
}

impl Default for ModelOptions {
    fn default() -> Self {
        ModelOptions { contrast: 0.25, max_points: 600, max_levels: 6 }
    }
}

impl ModelOptions {
    /// Refuses options outside their ranges.
    pub fn check(&self) -> Result<()> {
        if !(0.02..=1.0).contains(&self.contrast) {
            return Err(
                Fault::usage(format!("contrast is {}; allowed: 0.02 to 1", self.contrast)).next("correct contrast")
            );
        }
        if !(30..=5000).contains(&self.max_points) {
            return Err(Fault::usage(format!("max_points is {}; allowed: 30 to 5000", self.max_points))
                .next("correct max_points"));
        }
        if !(1..=8).contains(&self.max_levels) {
            return Err(
                Fault::usage(format!("max_levels is {}; allowed: 1 to 8", self.max_levels)).next("correct max_levels")
            );
        }
        Ok(())
    }
}

/// Least number of edge points of a model.
pub const MIN_POINTS: usize = 12;
/// The coarsest level keeps the model at least this large (half diagonal, px of that level).
const MIN_RADIUS: f64 = 14.0;
/// A level with fewer edge points is not used.
const MIN_LEVEL_POINTS: usize = 20;

impl ShapeModel {
    /// A model of the edges seen in `region`. The reference point is the region's centre unless stated. Refuses a
    /// region outside the scene, and one with too few edges.
    pub fn from_region(
        scene: &Scene,
        region: Region,
        reference: Option<[f64; 2]>,
        options: &ModelOptions,
    ) -> Result<ShapeModel> {
        options.check()?;
        region.check(scene.width(), scene.height())?;
        let [rx, ry] =
            reference.unwrap_or([0.5 * (region.x0 + region.x1 - 1) as f64, 0.5 * (region.y0 + region.y1 - 1) as f64]);
        let mut levels = Vec::new();
        for (level, layers) in scene.pyramid(options.max_levels).iter().enumerate() {
            let mut points = Vec::new();
            for layer in layers {
                let field = slopes(layer);
                let s = 1usize << level;
                let (w, h) = (field.width, field.height);
                let inside = [region.x0 / s, region.y0 / s, (region.x1 / s).min(w), (region.y1 / s).min(h)];
                for e in edges(&field, inside, options.contrast) {
                    points.push((
                        e.strength,
                        ModelPoint {
                            x: from_level(e.x, level) - rx,
                            y: from_level(e.y, level) - ry,
                            gx: e.gx,
                            gy: e.gy,
                            kind: layer.kind,
                            either: false,
                        },
                    ));
                }
            }
            points.sort_by(|a, b| b.0.total_cmp(&a.0));
            let points: Vec<ModelPoint> = points.into_iter().map(|p| p.1).collect();
            levels.push(thin(&points, (1u64 << level) as f64, options.max_points));
        }
        Self::finish(levels, "the region")
    }

    /// A model of a drawing on a map of `mm_per_px`. Shapes smaller than 5 px of a level are excluded from that level.
    pub fn from_drawing(drawing: &Drawing, mm_per_px: f64, kind: Kind, options: &ModelOptions) -> Result<ShapeModel> {
        options.check()?;
        drawing.check()?;
        if !(mm_per_px > 0.0 && mm_per_px.is_finite()) {
            return Err(Fault::usage(format!("mm_per_px is {mm_per_px}; allowed: above 0"))
                .next("give the edge of the map's cells in mm"));
        }
        // On long edges, no more than 20 times the points that the model can hold.
        let spacing = drawing.edge_length() / (20 * options.max_points) as f64;
        let samples = drawing.samples(spacing.max(0.5 * mm_per_px));
        let levels = (0..options.max_levels)
            .map(|level| {
                let px = (1u64 << level) as f64;
                let of_level: Vec<ModelPoint> = samples
                    .iter()
                    .filter(|s| s.search && s.extent >= 5.0 * px * mm_per_px)
                    .map(|s| ModelPoint {
                        x: s.x / mm_per_px,
                        y: s.y / mm_per_px,
                        gx: -s.nx,
                        gy: -s.ny,
                        kind,
                        either: s.either,
                    })
                    .collect();
                thin(&of_level, px, options.max_points)
            })
            .collect();
        Self::finish(levels, "the drawing")
    }

    /// The model of only those edge points for which `keep` is true.
    ///
    /// # Errors
    /// Too few edge points remain.
    pub fn only(self, keep: impl Fn(&ModelPoint) -> bool) -> Result<ShapeModel> {
        let chosen = |level: Vec<ModelPoint>| level.into_iter().filter(&keep).collect();
        Self::finish(self.levels.into_iter().map(chosen).collect(), "the part of the region that is seen")
    }

    /// The model of what `confirm` makes of each level's edge points, thinned to at most `most` on a level.
    ///
    /// # Errors
    /// Too few edge points remain.
    pub(in crate::find) fn confirmed(
        self,
        most: usize,
        confirm: impl Fn(usize, &ModelPoint) -> Option<ModelPoint>,
    ) -> Result<ShapeModel> {
        let of_level = |(level, points): (usize, &Vec<ModelPoint>)| {
            let kept: Vec<ModelPoint> = points.iter().filter_map(|p| confirm(level, p)).collect();
            thin(&kept, (1u64 << level) as f64, most)
        };
        Self::finish(self.levels.iter().enumerate().map(of_level).collect(), "what the examples have in common")
    }

    fn finish(mut levels: Vec<Vec<ModelPoint>>, origin: &str) -> Result<ShapeModel> {
        let found = levels[0].len();
        if found < MIN_POINTS {
            return Err(Fault::refused(format!("{origin} has {found} edge places, a model needs {MIN_POINTS}"))
                .cause("the region is even, nearly all missing, or too small")
                .next("choose a region with a clear outline, or lower the contrast"));
        }
        let bounds = |f: fn(&ModelPoint) -> f64| {
            let v = levels[0].iter().map(f);
            (v.clone().fold(f64::MAX, f64::min), v.fold(f64::MIN, f64::max))
        };
        let ((x0, x1), (y0, y1)) = (bounds(|p| p.x), bounds(|p| p.y));
        let half_size = [0.5 * (x1 - x0), 0.5 * (y1 - y0)];
        let half = half_size[0].hypot(half_size[1]);
        let mut keep = 1;
        while keep < levels.len()
            && half / (1u64 << keep) as f64 >= MIN_RADIUS
            && levels[keep].len() >= MIN_LEVEL_POINTS
        {
            keep += 1;
        }
        levels.truncate(keep);
        let radius = levels[0].iter().map(|p| p.x.hypot(p.y)).fold(0.0, f64::max);
        let redundancy = redundancy(&levels[0]);
        Ok(ShapeModel { redundancy, levels, radius, half_size, centre: [0.5 * (x0 + x1), 0.5 * (y0 + y1)] })
    }
}

/// Square of the distance beyond which two points share no noise, px²: exp(-d²/4) is below a thousandth.
const APART_SQUARED: f64 = 28.0;

/// Sum of a point's correlations with all points, itself included, as a mean over the points. This is the factor by
/// which the variance of their common result exceeds that of equally many independent points. exp(-d²/4) is the
/// correlation that the 5x5 plane fit (sigma 1 px) leaves at a distance of d px. Points of several layers count alike:
/// what moves an edge in one layer (the sheet's width, the raster of pixels, a chamfer) moves it in the others. A
/// second layer thus guards against gaps but does not halve the variance.
fn redundancy(points: &[ModelPoint]) -> f64 {
    let shared = |p: &ModelPoint, o: &ModelPoint| {
        let d2 = (o.x - p.x).powi(2) + (o.y - p.y).powi(2);
        if d2 > APART_SQUARED {
            return 0.0;
        }
        let cosine = o.gx * p.gx + o.gy * p.gy;
        // Light may fall where height rises; within a layer, edges that face each other are two separate edges.
        let alike = if o.kind == p.kind && !p.either { cosine.max(0.0) } else { cosine.abs() };
        alike * (-0.25 * d2).exp()
    };
    let sum: f64 = points.iter().map(|p| points.iter().map(|o| shared(p, o)).sum::<f64>()).sum();
    (sum / points.len() as f64).max(1.0)
}

/// An edge point of a field with its sub-pixel position.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// Column, px.
    pub x: f64,
    /// Row, px.
    pub y: f64,
    /// x of the unit direction in which values rise.
    pub gx: f64,
    /// y of the unit direction in which values rise.
    pub gy: f64,
    /// Slope at the edge's cell, the layer's unit per px.
    pub strength: f64,
}

/// Ridges of the slope's magnitude inside `[x0, y0, x1, y1)` above three times the noise and above `contrast` times the
/// 95th percentile of those, with at least two neighbours of similar direction. The noise has ridges of its own: in a
/// region that is mostly even they are nearly all, and would set the percentile.
pub fn edges(field: &Field, [x0, y0, x1, y1]: [usize; 4], contrast: f64) -> Vec<Edge> {
    let w = field.width;
    let (x0, y0) = (x0.max(2), y0.max(2));
    let (x1, y1) = (x1.min(field.width.saturating_sub(2)), y1.min(field.height.saturating_sub(2)));
    if x0 >= x1 || y0 >= y1 {
        return vec![];
    }
    let mut ridge = Vec::new();
    for y in y0..y1 {
        for x in x0..x1 {
            let i = y * w + x;
            let m = f64::from(field.magnitude(i));
            if m <= 0.0 {
                continue;
            }
            let (gx, gy) = (f64::from(field.gx[i]) / m, f64::from(field.gy[i]) / m);
            let along = |s: f64| {
                let (a, b) = field.at(x as f64 + s * gx, y as f64 + s * gy)?;
                Some(a * gx + b * gy)
            };
            let (Some(before), Some(after)) = (along(-1.0), along(1.0)) else { continue };
            if let Some(shift) = ridge_offset(before, m, after) {
                ridge.push((i, Edge { x: x as f64 + shift * gx, y: y as f64 + shift * gy, gx, gy, strength: m }));
            }
        }
    }
    let least = 3.0 * f64::from(field.noise());
    let mut strengths: Vec<f64> = ridge.iter().map(|r| r.1.strength).filter(|s| *s >= least).collect();
    if strengths.is_empty() {
        return vec![];
    }
    let top = strengths.len() * 95 / 100;
    let limit = (contrast * *strengths.select_nth_unstable_by(top, f64::total_cmp).1).max(least);
    let mut on = vec![u32::MAX; w * field.height];
    let strong: Vec<(usize, Edge)> = ridge.into_iter().filter(|r| r.1.strength >= limit).collect();
    for (k, r) in strong.iter().enumerate() {
        on[r.0] = k as u32;
    }
    let like = |i: usize, e: &Edge| {
        let around = [i - w - 1, i - w, i - w + 1, i - 1, i + 1, i + w - 1, i + w, i + w + 1];
        around
            .iter()
            .filter(|&&j| {
                on[j] != u32::MAX && {
                    let o = &strong[on[j] as usize].1;
                    o.gx * e.gx + o.gy * e.gy > 0.7
                }
            })
            .count()
    };
    strong.iter().filter(|(i, e)| like(*i, e) >= 2).map(|(_, e)| *e).collect()
}

/// Position of the top of a ridge with these three heights, -0.5 to 0.5 px. It is exact for a Gaussian, the slope of a
/// blurred step. `None` where the middle is not the highest.
pub fn ridge_offset(before: f64, middle: f64, after: f64) -> Option<f64> {
    if !(middle > before && middle >= after) {
        return None;
    }
    let (a, b, c) = if before > 0.05 * middle && after > 0.05 * middle {
        (before.ln(), middle.ln(), after.ln())
    } else {
        (before, middle, after)
    };
    Some((0.5 * (a - c) / (a - 2.0 * b + c)).clamp(-0.5, 0.5))
}

/// Thins the list to points at least `spacing` apart; earlier points take precedence. The spacing is widened until at
/// most `max` remain, and each spacing is abandoned at the first point beyond `max`.
pub fn thin(points: &[ModelPoint], mut spacing: f64, max: usize) -> Vec<ModelPoint> {
    'wider: loop {
        let mut taken = std::collections::HashMap::<(i64, i64), Vec<usize>>::new();
        let mut kept: Vec<ModelPoint> = Vec::new();
        for p in points {
            let (cx, cy) = ((p.x / spacing).floor() as i64, (p.y / spacing).floor() as i64);
            let near = (-1..=1).any(|dy| {
                (-1..=1).any(|dx| {
                    taken.get(&(cx + dx, cy + dy)).is_some_and(|list| {
                        list.iter().any(|&k| {
                            let o: &ModelPoint = &kept[k];
                            o.kind == p.kind
                                && (o.x - p.x).hypot(o.y - p.y) < spacing
                                && o.gx * p.gx + o.gy * p.gy > 0.0
                        })
                    })
                })
            });
            if !near {
                if kept.len() == max {
                    spacing *= 1.1;
                    continue 'wider;
                }
                taken.entry((cx, cy)).or_default().push(kept.len());
                kept.push(*p);
            }
        }
        return kept;
    }
}
