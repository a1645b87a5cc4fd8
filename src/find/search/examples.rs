//! In: several pictures of a part, the region of it in the first. Out: a template of what they have in common: edges
//! that agree in most of them, mean grey levels without those that vary. Labels, serial numbers and dirt drop out.
//! Frame and unit: pixels of the first picture; points about the region's middle.

use super::accelerator::Accelerator;
use super::full::{Match, automatic};
use super::options::SearchOptions;
use super::refine::Pose;
use super::taught::{Weak, find_taught, witness};
use super::witness::between;
use crate::fault::{Fault, Result};
use crate::find::model::gradient::{Field, slopes};
use crate::find::model::levels::Levels;
use crate::find::model::shape_model::{ModelOptions, ModelPoint, ShapeModel};
use crate::find::model::template::{Taken, Template};
use crate::find::scene::{Layer, Region, Scene, to_level};
use crate::raster::{Image, Mask};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;

/// A picture of the part.
#[derive(Clone, Debug)]
pub struct Example<'a> {
    /// The picture.
    pub image: &'a Image,
    /// Where it is hidden, or nothing counts.
    pub hidden: Option<&'a Mask>,
    /// Name of the picture.
    pub picture: String,
    /// SHA-256 of its file.
    pub sha256: String,
}

/// Most examples of a part; each is held with its slopes.
const MOST: usize = 50;
/// Least mean cosine between an edge of the first example and the others there. A single direction by chance passes
/// with 0.3, the mean of two with 0.1.
const AGREE: f64 = 0.6;
/// Edge points that are taught, as a multiple of those that the model keeps. Print that drops out later then takes no
/// place of the outline.
const SPARE: usize = 4;
/// A level varies where an example differs from the mean by more than this many sigmas.
const SIGMAS: f32 = 4.0;
/// Part of sigma that stands for what moves an edge between examples, px: times the slope there.
const MOVED_PX: f32 = 0.3;
/// Least sigma of a level as a share of the region's range: rounding to whole levels.
const ROUNDED: f32 = 0.004;

/// Learns what all examples show; `region` (x, y, width, height) is that of the first. In the others the part is found
/// with the first one's template, at any turn and the same size.
///
/// # Errors
/// Those of [`Template::teach_in_part`]; no example or more than 50; an example in which the part is not found; fewer
/// common edges than a template needs.
pub fn teach_examples(
    name: &str,
    examples: &[Example],
    region: Option<[u32; 4]>,
    options: &ModelOptions,
    accelerator: Option<&Accelerator>,
) -> Result<Template> {
    let Some((first, others)) = examples.split_first().filter(|_| examples.len() <= MOST) else {
        return Err(Fault::usage(format!("{} pictures of the part; allowed: 1 to {MOST}", examples.len()))
            .next("choose pictures that show what varies"));
    };
    let teach = |options: &ModelOptions| {
        let source = (first.picture.clone(), first.sha256.clone());
        Template::teach_in_part(name, first.image, first.hidden, region, source, options)
    };
    let mut template = teach(options)?;
    if others.is_empty() {
        return Ok(template);
    }
    let views: Vec<(Scene, Match)> = others
        .iter()
        .map(|e| {
            let scene = Scene::from_image_in_part(e.image, e.hidden);
            let found = found(&template, &scene, e, accelerator)?;
            Ok((scene, found))
        })
        .collect::<Result<_>>()?;
    let rich = teach(&ModelOptions { max_points: (SPARE * options.max_points).min(5000), ..*options })?.model;
    let all = rich.levels[0].len();
    let (model, stayed) = common(rich, &views, options.max_points)?;
    let [x, y, w, h] = template.region_px.map(|n| n as usize);
    let own = Scene::from_image_in_part(first.image, first.hidden).crop(Region { x0: x, y0: y, x1: x + w, y1: y + h });
    template.levels = Levels::of(&mean(&own.layers[0], &views));
    template.examples = others.iter().zip(&views).map(|(e, (_, m))| taken(e, m)).collect();
    template.confirmed = Some([stayed, all]);
    template.model = model;
    Ok(template)
}

fn taken(e: &Example, m: &Match) -> Taken {
    Taken {
        picture: e.picture.clone(),
        picture_sha256: e.sha256.clone(),
        x_px: m.pose.x,
        y_px: m.pose.y,
        angle_deg: SearchOptions::default().turn_deg(m.pose.angle),
        score: m.score,
        correlation: m.correlation,
    }
}

/// The part in an example. Of poses whose edges fit nearly alike the one is taken whose grey levels correlate best.
fn found(template: &Template, scene: &Scene, example: &Example, accelerator: Option<&Accelerator>) -> Result<Match> {
    let (options, weak) = (SearchOptions::default(), Weak::default());
    let found = find_taught(scene, template, &options, Some(&weak), None, accelerator)?;
    let Some(mut best) = found.into_iter().next() else {
        return Err(Fault::refused(format!(
            "the part of the first example is not found in {}: no score of {}, nor of {} with grey levels that \
             correlate by {}",
            example.picture, options.min_score, weak.min_score, weak.min_correlation
        ))
        .cause("another part, another size, or a region of which most varies")
        .next("omit this picture, choose a region with more of what stays the same, or mask what varies"));
    };
    let Some(witness) = witness(scene, template, options.scales) else { return Ok(best) };
    for (pose, score) in best.rivals.clone() {
        let correlation = witness.correlation(&pose);
        if score >= options.ambiguous_at * best.score && correlation > best.correlation {
            (best.pose, best.score, best.correlation) = (pose, score, correlation);
        }
    }
    Ok(best)
}

/// The slopes of an example on every level, with the least contrast of an edge there.
fn fields(scene: &Scene, levels: usize) -> Vec<(Field, f32)> {
    let of = |layers: Vec<Layer>| {
        let field = slopes(&layers[0]);
        let least = automatic(&field);
        (field, least)
    };
    scene.pyramid(levels).into_iter().map(of).collect()
}

/// The edge points whose direction the examples confirm, with their mean direction, and how many of level 0 stayed.
fn common(rich: ShapeModel, views: &[(Scene, Match)], most: usize) -> Result<(ShapeModel, usize)> {
    let seen: Vec<(Vec<(Field, f32)>, Pose)> =
        views.par_iter().map(|(scene, m)| (fields(scene, rich.levels.len()), m.pose)).collect();
    let confirm = |level: usize, p: &ModelPoint| confirmed(level, p, &seen);
    let stayed = rich.levels[0].iter().filter(|p| confirm(0, p).is_some()).count();
    Ok((rich.confirmed(most, confirm)?, stayed))
}

/// An edge point with the mean direction of all examples; `None` where the others' mean cosine to it is too small.
/// Examples that do not show its place do not vote.
fn confirmed(level: usize, p: &ModelPoint, seen: &[(Vec<(Field, f32)>, Pose)]) -> Option<ModelPoint> {
    let (mut votes, mut cosines, mut sum) = (0.0, 0.0, [p.gx, p.gy]);
    for (fields, pose) in seen {
        let (field, least) = fields.get(level)?;
        let (x, y, _, _) = pose.place(p);
        let Some((gx, gy)) = field.at(to_level(x, level), to_level(y, level)) else { continue };
        votes += 1.0;
        let (strength, (s, c)) = (gx.hypot(gy), pose.angle.sin_cos());
        if strength > f64::from(*least) {
            let back = [(c * gx + s * gy) / strength, (c * gy - s * gx) / strength];
            cosines += back[0] * p.gx + back[1] * p.gy;
            sum = [sum[0] + back[0], sum[1] + back[1]];
        }
    }
    let length = sum[0].hypot(sum[1]);
    (cosines >= AGREE * votes && length > 0.0).then(|| ModelPoint { gx: sum[0] / length, gy: sum[1] / length, ..*p })
}

/// Mean of the examples' values over the first one's region; missing where they vary by more than noise explains.
fn mean(first: &Layer, views: &[(Scene, Match)]) -> Layer {
    let (w, h) = (first.width, first.height);
    let under = |scene: &Scene, pose: &Pose| -> Vec<f32> {
        let place = |i: usize, n: usize| i as f64 - 0.5 * (n as f64 - 1.0);
        let value = |i: usize| {
            let (x, y) = pose.point(place(i % w, w), place(i / w, h));
            between(&scene.layers[0], x, y).map_or(f32::NAN, |v| v as f32)
        };
        let values: Vec<f32> = (0..w * h).into_par_iter().map(value).collect();
        let [gain, offset] = light(&values, &first.values);
        values.iter().map(|v| gain * v + offset).collect()
    };
    let mut all: Vec<Vec<f32>> = views.iter().map(|(scene, m)| under(scene, &m.pose)).collect();
    all.push(first.values.clone());
    let mut out = first.clone();
    for (i, v) in out.values.iter_mut().enumerate().filter(|(_, v)| !v.is_nan()) {
        let seen = all.iter().map(|e| e[i]).filter(|v| !v.is_nan());
        *v = seen.clone().sum::<f32>() / seen.count() as f32;
    }
    let differences = |i: usize, mean: f32| all.iter().map(move |e| (e[i] - mean).abs()).filter(|d| !d.is_nan());
    let spread: Vec<f32> = out.values.iter().enumerate().flat_map(|(i, v)| differences(i, *v)).collect();
    let seen = || first.values.iter().filter(|v| !v.is_nan());
    let range = seen().copied().fold(f32::MIN, f32::max) - seen().copied().fold(f32::MAX, f32::min);
    let n = all.len() as f32;
    let sigma = (1.4826 * median(spread) * (n / (n - 1.0)).sqrt()).max(ROUNDED * range);
    let edges = slopes(&out);
    for (i, v) in out.values.iter_mut().enumerate() {
        let limit = SIGMAS * sigma.hypot(MOVED_PX * edges.magnitude(i));
        if differences(i, *v).any(|d| d > limit) {
            *v = f32::NAN;
        }
    }
    out
}

/// Least and largest gain between examples.
const GAINS: [f64; 2] = [0.2, 5.0];

/// Gain and offset that bring an example's values to the first one's, without what differs between them: the line
/// through two pixels with the least median difference (least median of squares, Rousseeuw 1984), then least squares.
fn light(values: &[f32], first: &[f32]) -> [f32; 2] {
    const TRIES: usize = 300;
    const COMPARED: usize = 2000;
    let shown = values.iter().zip(first).filter(|(v, a)| !v.is_nan() && !a.is_nan());
    let pairs: Vec<[f64; 2]> = shown.map(|(v, a)| [f64::from(*v), f64::from(*a)]).collect();
    let few: Vec<&[f64; 2]> = pairs.iter().step_by(pairs.len().div_ceil(COMPARED).max(1)).collect();
    let off = |fit: [f64; 2], p: &[f64; 2]| (p[1] - fit[0] * p[0] - fit[1]).abs();
    let middle = |fit: [f64; 2]| median(few.iter().map(|p| off(fit, p) as f32).collect());
    let mut rng = Pcg64::seed_from_u64(1);
    let mut best = ([1.0, 0.0], f32::INFINITY);
    for _ in 0..if few.is_empty() { 0 } else { TRIES } {
        let [p, q] = [0; 2].map(|_| few[rng.random_range(0..few.len())]);
        let gain = (p[1] - q[1]) / (p[0] - q[0]);
        let gain = if gain.is_finite() { gain.clamp(GAINS[0], GAINS[1]) } else { 1.0 };
        let fit = [gain, p[1] - gain * p[0]];
        let m = middle(fit);
        if m < best.1 {
            best = (fit, m);
        }
    }
    // A median of 0 is that of whole levels, whose rounding stays within 1.
    let limit = f64::from(2.5 * 1.4826 * best.1).max(1.0);
    least_squares(pairs.iter().filter(|p| off(best.0, p) <= limit)).unwrap_or(best.0).map(|v| v as f32)
}

/// The line of least squares; `None` of even values or a gain out of range.
fn least_squares<'a>(pairs: impl Iterator<Item = &'a [f64; 2]>) -> Option<[f64; 2]> {
    let mut s = [0.0f64; 5];
    for [v, a] in pairs {
        s.iter_mut().zip([1.0, *v, *a, v * v, v * a]).for_each(|(s, t)| *s += t);
    }
    let gain = (s[4] - s[1] * s[2] / s[0]) / (s[3] - s[1] * s[1] / s[0]);
    (GAINS[0]..=GAINS[1]).contains(&gain).then(|| [gain, (s[2] - gain * s[1]) / s[0]])
}

/// The middle value; 0 of none.
fn median(mut values: Vec<f32>) -> f32 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_is_measured_beside_what_differs() {
        let first: Vec<f32> = (0..400).map(|i| 50.0 + (i % 20) as f32 * 5.0).collect();
        // A third of the values is another label.
        let other: Vec<f32> =
            first.iter().enumerate().map(|(i, a)| if i % 3 == 0 { 240.0 } else { (a - 20.0) / 1.6 }).collect();
        let [gain, offset] = light(&other, &first);
        assert!((gain - 1.6).abs() < 0.01 && (offset - 20.0).abs() < 0.5, "{gain} {offset}");
        assert_eq!(light(&[f32::NAN; 3], &[1.0, 2.0, 3.0]), [1.0, 0.0]);
    }
}
