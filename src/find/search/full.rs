//! In: a scene, a shape model, search options. Out: matches with score, runner-up, sigma and warnings, by a pyramid
//! search over quantised directions, then directions, then least squares (\[steger02\]).
//! Frame and unit: pixels of the scene, degrees in options, radians in poses.

use super::accelerator::Accelerator;
use super::area::Area;
use super::climb::{Candidate, Directions, climb, hills, score};
use super::coarse::{Query, Turn, turn_between};
use super::level::Level;
use super::options::SearchOptions;
use super::refine::{Pose, Refined, refine};
use crate::fault::{Fault, Result};
use crate::find::model::gradient::{Field, slopes};
use crate::find::model::shape_model::ShapeModel;
use crate::find::scene::{Kind, Scene, from_level};
use crate::stages::shape::frame::STRIDE;
use rayon::prelude::*;

/// A model that reaches farther than this many times the map's diagonal is not searched: at no pose does the map hold
/// half of its edges, and turns and memory grow with its reach.
const MOST_ACROSS: f64 = 4.0;

/// Tolerance at the limits of a range (rad, share of the scale). Rounding moves a value that is fixed at a limit by
/// less, so the limit itself lies inside.
const HAIR: f64 = 1e-9;

/// A match.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Match {
    /// Position (px of the scene), turn (rad) and scale.
    pub pose: Pose,
    /// Mean cosine between directions; places of weak contrast count 0, places on missing cells half.
    pub score: f64,
    /// Share of the model's places whose slope is known.
    pub coverage: f64,
    /// The best score of another pose in the same place (turned, or shifted by less than the part); 0 if there is none.
    pub second_score: f64,
    /// Standard deviations of x and y, px.
    pub sigma_px: [f64; 2],
    /// Standard deviations of x and y, mm; `None` for a scene without scale.
    pub sigma_mm: Option<[f64; 2]>,
    /// Standard deviation of the turn, degrees.
    pub sigma_deg: f64,
    /// Standard deviation of the scale, as a share of it; 0 where the scale was given.
    pub sigma_scale: f64,
    /// Number of edges that the least squares used.
    pub edges: usize,
    /// Robust deviation of these edges, px.
    pub edge_rms_px: f64,
    /// Other poses in the same place with their scores, best first, at most eight.
    pub rivals: Vec<(Pose, f64)>,
    /// A rival that fits almost as well, in words.
    pub warning: Option<String>,
    /// Normalised correlation of the template's values with the scene's, -1 to 1; `None` where the template has no
    /// values or the scene shows less than half of them.
    pub correlation: Option<f64>,
}

/// Finds the model in the scene, best match first. An empty list means that nothing reached the least score.
pub fn find(scene: &Scene, model: &ShapeModel, options: &SearchOptions) -> Result<Vec<Match>> {
    find_on(scene, model, options, None)
}

/// Like [`find`], with the coarse search on a GPU where it pays; the matches are the same.
pub fn find_on(
    scene: &Scene,
    model: &ShapeModel,
    options: &SearchOptions,
    accelerator: Option<&Accelerator>,
) -> Result<Vec<Match>> {
    find_in(scene, model, options, None, accelerator)
}

/// Like [`find_on`], for matches whose middle lies in an area; only the part of the scene that this needs is searched.
pub fn find_in(
    scene: &Scene,
    model: &ShapeModel,
    options: &SearchOptions,
    area: Option<&Area>,
    accelerator: Option<&Accelerator>,
) -> Result<Vec<Match>> {
    find_where(scene, model, options, area, &|_| true, accelerator)
}

/// Like [`find_in`], for matches whose pose `also` accepts; it is asked before overlaps are resolved.
pub(super) fn find_where(
    scene: &Scene,
    model: &ShapeModel,
    options: &SearchOptions,
    area: Option<&Area>,
    also: &(dyn Fn(&Pose) -> bool + Sync),
    accelerator: Option<&Accelerator>,
) -> Result<Vec<Match>> {
    options.check()?;
    let Some(area) = area else { return search(scene, model, options, also, accelerator) };
    let cells = area.cells(scene, model, options)?;
    let (dx, dy) = (cells.x0 as f64, cells.y0 as f64);
    let shifted = |p: &Pose| Pose { x: p.x + dx, y: p.y + dy, ..*p };
    let inside = |p: &Pose| area.holds(model, &shifted(p)) && also(&shifted(p));
    let mut found = search(&scene.crop(cells), model, options, &inside, accelerator)?;
    for m in &mut found {
        m.pose = shifted(&m.pose);
        m.rivals.iter_mut().for_each(|r| r.0 = shifted(&r.0));
    }
    Ok(found)
}

fn search(
    scene: &Scene,
    model: &ShapeModel,
    options: &SearchOptions,
    inside: &(dyn Fn(&Pose) -> bool + Sync),
    accelerator: Option<&Accelerator>,
) -> Result<Vec<Match>> {
    for p in &model.levels[0] {
        if !scene.layers.iter().any(|l| l.kind == p.kind) {
            return Err(Fault::usage(format!("the model has {:?} edges, the scene has no such layer", p.kind))
                .cause("a model of heights is searched in a picture, or the reverse")
                .next("teach the model from a map of the same kind"));
        }
    }
    let across = (scene.width() as f64).hypot(scene.height() as f64);
    if model.radius > MOST_ACROSS * across {
        let (of, to) = match scene.mm_per_px {
            Some(mm) => (format!("{:.0} mm", model.radius * mm), format!("{:.0} mm", across * mm)),
            None => (format!("{:.0} px", model.radius), format!("{across:.0} px")),
        };
        return Err(Fault::refused(format!(
            "the model reaches {of} from its origin, the map is {to} across, limit {MOST_ACROSS} times that"
        ))
        .cause("a slipped decimal point in a size, another unit, or an origin far from the part")
        .next("correct the drawing, or scan more of the part"));
    }
    // The strided grid needs a few columns and rows; a smaller map is searched on a finer level.
    let most = (0..model.levels.len()).rev().find(|l| scene.width().min(scene.height()) >> l >= 8).unwrap_or(0);
    let levels: Vec<Vec<Directions>> = scene
        .pyramid(most + 1)
        .into_iter()
        .map(|layers| {
            layers
                .into_iter()
                .map(|l| {
                    let field = slopes(&l);
                    let threshold = options.min_contrast.map_or_else(|| automatic(&field), |c| c as f32);
                    Directions::new(l.kind, field, threshold)
                })
                .collect()
        })
        .collect();
    let mut candidates = Vec::new();
    for level in (0..=most).rev() {
        let begin = sizes_from(model, level, most, options.scales)
            .map_or(vec![], |sizes| coarse_candidates(&levels[level], model, level, sizes, options, accelerator));
        let came = std::mem::take(&mut candidates).into_iter().map(|c| (c, false));
        let all: Vec<(Candidate, bool)> = came.chain(begin.into_iter().map(|c| (c, true))).collect();
        let keep = if level == 0 { options.candidates.min(4 * options.max_matches + 100) } else { options.candidates };
        candidates = all
            .into_par_iter()
            .map(|(c, first)| climb(&levels[level], &model.levels[level], level, c, model.radius, options, first))
            .collect();
        let limit = options.min_score - if level == 0 { 0.05 } else { 0.12 };
        candidates.retain(|c| c.score >= limit);
        candidates = distinct(candidates, (1 << level) as f64, model.radius, keep);
        if levels[level].iter().any(|d| d.gaps) {
            candidates.extend(beside_shadows(&levels[level], model, level, &candidates, options));
            candidates.retain(|c| c.score >= limit);
            candidates = distinct(candidates, (1 << level) as f64, model.radius, keep);
        }
    }
    Ok(finish(scene, &levels[0], model, candidates, options, inside))
}

/// The best candidates' rivals across a shadow, each climbed to its local maximum.
fn beside_shadows(
    layers: &[Directions],
    model: &ShapeModel,
    level: usize,
    candidates: &[Candidate],
    options: &SearchOptions,
) -> Vec<Candidate> {
    /// Number of candidates that are examined: more than the turns at which most parts look nearly alike.
    const LEADING: usize = 8;
    let points = &model.levels[level];
    let leading = candidates[..candidates.len().min(LEADING)].par_iter();
    leading
        .flat_map_iter(|c| hills(layers, points, level, c, options.ignore_polarity))
        .map(|c| climb(layers, points, level, c, model.radius, options, false))
        .collect()
}

/// Contrast threshold: three times the noise, but not below a thousandth of the layer's strong slopes. Otherwise a
/// noise-free picture would have rounding errors for edges.
pub(super) fn automatic(field: &Field) -> f32 {
    let step = (field.gx.len() / 20_000).max(1);
    let mut m: Vec<f32> = (0..field.gx.len()).step_by(step).map(|i| field.magnitude(i)).collect();
    let top = m.len() * 99 / 100;
    let strong = *m.select_nth_unstable_by(top, f32::total_cmp).1;
    // In a picture full of edges, the lower quartile is not noise: a fifth of the strong slopes bounds it.
    (3.0 * field.noise()).min(0.2 * strong).max(1e-3 * strong).max(1e-6)
}

/// A part smaller than this (half diagonal, px of the level) has too few cells to be recognised.
const SMALLEST: f64 = 10.0;

/// The scales of a range whose search starts on this level: it is the coarsest that shows a part of their size.
fn sizes_from(model: &ShapeModel, level: usize, most: usize, [s0, s1]: [f64; 2]) -> Option<[f64; 2]> {
    let half = model.half_size[0].hypot(model.half_size[1]);
    let shown = |level: usize| SMALLEST * (1u64 << level) as f64 / half;
    let least = if level == 0 { 0.0 } else { shown(level) };
    let end = if level == most { f64::INFINITY } else { shown(level + 1) };
    let (low, high) = (s0.max(least), s1.min(end));
    (low < high || (low == high && high < end)).then_some([low, high])
}

fn turns(model: &ShapeModel, level: usize, [s0, s1]: [f64; 2], options: &SearchOptions) -> Vec<Turn> {
    // Half the spread window at the rim of the model.
    let rim = (s1 * model.radius / (1u64 << level) as f64).max(4.0);
    let step = (STRIDE as f64 * 0.4) / rim;
    let [a0, a1] = options.angles_deg.map(f64::to_radians);
    let full = a1 - a0 > std::f64::consts::TAU - step;
    let n = ((a1 - a0) / step).ceil() as usize + usize::from(!full);
    let scale_step = 1.0 + step;
    let m = ((s1 / s0).ln() / scale_step.ln()).ceil() as usize + 1;
    let mut out = Vec::with_capacity(n * m);
    for k in 0..m {
        let scale = if m == 1 { s0 } else { s0 * (s1 / s0).powf(k as f64 / (m - 1) as f64) };
        for i in 0..n.max(1) {
            let span = if full { n } else { n.max(2) - 1 };
            out.push(Turn { angle: a0 + (a1 - a0) * i as f64 / span as f64, scale });
        }
    }
    out
}

fn coarse_candidates(
    layers: &[Directions],
    model: &ShapeModel,
    level: usize,
    sizes: [f64; 2],
    options: &SearchOptions,
    accelerator: Option<&Accelerator>,
) -> Vec<Candidate> {
    let px = (1u64 << level) as f64;
    let turns = turns(model, level, sizes, options);
    let inputs: Vec<(Kind, &Field, f32)> = layers.iter().map(|d| (d.kind, &d.field, d.threshold)).collect();
    let ignore = options.ignore_polarity || model.levels[level].iter().all(|p| p.either);
    let coarse = Level::new(&inputs, ignore, (0.5 * model.radius / px) as usize);
    let apart = 2.0 * (STRIDE as f64 * 0.5) / (sizes[1] * model.radius / px).max(4.0);
    // Spreading only raises a score; quantising costs up to a quarter of it.
    let limit = (0.75 * (options.min_score - 0.1)).max(0.2) as f32;
    let query = Query { model: &model.levels[level], turns: &turns, px, limit, most: options.candidates, apart };
    coarse
        .search(&query, accelerator)
        .into_iter()
        .map(|h| Candidate {
            pose: Pose {
                x: from_level(h.x, level),
                y: from_level(h.y, level),
                angle: turns[h.pose].angle,
                scale: turns[h.pose].scale,
            },
            score: f64::from(h.score),
        })
        .collect()
}

/// The candidates, best first, without those that climbed to the same pose.
fn distinct(mut candidates: Vec<Candidate>, px: f64, radius: f64, most: usize) -> Vec<Candidate> {
    candidates.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut kept: Vec<Candidate> = Vec::new();
    for c in candidates {
        if kept.len() < most && !kept.iter().any(|k| same(&k.pose, &c.pose, 2.5 * px, radius)) {
            kept.push(c);
        }
    }
    kept
}

/// True where two poses differ by less than `px` anywhere on the model.
fn same(a: &Pose, b: &Pose, px: f64, radius: f64) -> bool {
    let radius = radius * a.scale.max(b.scale);
    (a.x - b.x).hypot(a.y - b.y) < px
        && turn_between(a.angle, b.angle) * radius < 1.5 * px
        && (a.scale / b.scale).ln().abs() * radius < 1.5 * px
}

fn finish(
    scene: &Scene,
    layers: &[Directions],
    model: &ShapeModel,
    candidates: Vec<Candidate>,
    options: &SearchOptions,
    inside: &(dyn Fn(&Pose) -> bool + Sync),
) -> Vec<Match> {
    let fields: Vec<(Kind, &Field, f32)> = layers.iter().map(|d| (d.kind, &d.field, d.threshold)).collect();
    let stood: Vec<_> = candidates
        .par_iter()
        .filter_map(|c| {
            let (r, s, coverage) = refined(layers, &fields, model, c, options)?;
            // The range limits what is returned, not where the search starts.
            let slack = |k: usize| HAIR + 3.0 * r.covariance[(k, k)].max(0.0).sqrt();
            if !options.holds_angle(r.pose.angle, slack(2)) || !options.holds_scale(r.pose.scale, slack(3)) {
                return None;
            }
            Some((r, s.max(c.score), coverage))
        })
        .collect();
    let mut order: Vec<usize> = (0..stood.len()).collect();
    order.sort_by(|&a, &b| stood[b].1.total_cmp(&stood[a].1));
    let mut out: Vec<(usize, Match)> = Vec::new();
    for &i in &order {
        let (r, s, coverage) = &stood[i];
        if *s < options.min_score || out.len() == options.max_matches {
            break;
        }
        if !inside(&r.pose) || out.iter().any(|(_, m)| overlap(model, &m.pose, &r.pose) > options.max_overlap) {
            continue;
        }
        let mut rivals: Vec<(Pose, f64)> = Vec::new();
        for &k in &order {
            let (o, score, _) = &stood[k];
            let elsewhere = rivals.iter().map(|r| &r.0).chain([&r.pose]).all(|p| !same(p, &o.pose, 3.0, model.radius));
            if rivals.len() < 8 && elsewhere && overlap(model, &o.pose, &r.pose) > options.max_overlap.max(0.2) {
                rivals.push((o.pose, *score));
            }
        }
        let rival = rivals.first().copied();
        let second_score = rival.map_or(0.0, |r| r.1);
        let warning = rival.filter(|_| second_score > options.ambiguous_at * s).map(|(o, _)| {
            format!(
                "a pose turned by {:.1} degrees and shifted by {:.1} px scores {second_score:.3} against {s:.3}",
                turn_between(o.angle, r.pose.angle).to_degrees(),
                (o.x - r.pose.x).hypot(o.y - r.pose.y)
            )
        });
        let sd = |k: usize| r.covariance[(k, k)].max(0.0).sqrt();
        out.push((
            i,
            Match {
                pose: r.pose,
                score: *s,
                coverage: *coverage,
                second_score,
                sigma_px: [sd(0), sd(1)],
                sigma_mm: scene.mm_per_px.map(|k| [sd(0) * k, sd(1) * k]),
                sigma_deg: sd(2).to_degrees(),
                sigma_scale: sd(3),
                edges: r.used,
                edge_rms_px: r.rms_px,
                rivals,
                warning,
                correlation: None,
            },
        ));
    }
    out.into_iter().map(|m| m.1).collect()
}

/// Refines a candidate; returns also the score and the coverage there. Where cells are missing, few edges constrain a
/// pose, and later rounds may drift along them to a shadow's edges. If the last round has left the candidate, the
/// earlier round with the best score is taken.
fn refined(
    layers: &[Directions],
    fields: &[(Kind, &Field, f32)],
    model: &ShapeModel,
    candidate: &Candidate,
    options: &SearchOptions,
) -> Option<(Refined, f64, f64)> {
    const ROUNDS: usize = 8;
    let after = |rounds: usize| {
        let r = refine(fields, model, candidate.pose, options.free(), options.ignore_polarity, rounds)?;
        let (score, coverage) = score(layers, &model.levels[0], 0, &r.pose, options.ignore_polarity);
        same(&r.pose, &candidate.pose, 4.0, model.radius).then_some((r, score, coverage))
    };
    after(ROUNDS).or_else(|| (1..ROUNDS).filter_map(after).max_by(|a, b| a.1.total_cmp(&b.1)))
}

/// Share of the smaller of two turned boxes that lies in the other, by sampling a 9x9 grid.
pub(super) fn overlap(model: &ShapeModel, a: &Pose, b: &Pose) -> f64 {
    let (small, large) = if a.scale <= b.scale { (a, b) } else { (b, a) };
    let (s, c) = large.angle.sin_cos();
    let mut inside = 0;
    for iy in 0..9 {
        for ix in 0..9 {
            let local = |k: usize, i: i32| model.centre[k] + model.half_size[k] * (f64::from(i) - 4.0) / 4.5;
            let (x, y) = small.point(local(0, ix), local(1, iy));
            let (dx, dy) = ((x - large.x) / large.scale, (y - large.y) / large.scale);
            let (lx, ly) = (c * dx + s * dy - model.centre[0], c * dy - s * dx - model.centre[1]);
            inside += i32::from(lx.abs() <= model.half_size[0] && ly.abs() <= model.half_size[1]);
        }
    }
    f64::from(inside) / 81.0
}
