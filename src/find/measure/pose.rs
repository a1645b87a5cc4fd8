//! In: the points of a scan, a drawing, a first pose. Out: the part's pose by least squares on the
//! points: heights of its faces give height and tilt, ends of its surfaces give place and turn
//! (docs/math.md, Insertion (1) to (4)).
//! Frame and unit: base_from_part; mm, rad; covariance over x y z rx ry rz about the part's own axes.

use super::datum;
use super::datum::{Datum, fit_datum};
use super::in_plane::fit_edges;
use super::lit_edges::fit_light;
use super::options::MeasureOptions;
use super::points::{Ordered, localise};
use super::shape::Shape;
use super::sizes::measure_shape;
use super::surface_ends::{Observation, surface_ends};
use crate::fault::{Fault, Result};
use crate::find::model::drawing::Drawing;
use crate::find::model::edge_index::EdgeIndex;
use crate::geometry::{Base, Part, Rigid, Vec3};
use nalgebra::{Matrix6, Vector3};

/// A measured pose.
#[derive(Clone, Debug)]
pub struct Measured {
    /// The measured pose, mm.
    pub base_from_part: Rigid<Base, Part>,
    /// 6 x 6 over x y z rx ry rz about the part's own axes, mm and rad.
    pub covariance: Matrix6<f64>,
    /// Points that gave height and tilt, and their robust deviation, mm.
    pub surface_points: usize,
    /// Robust deviation of these points from their faces, mm.
    pub surface_rms: f64,
    /// Surface ends at the drawn edges, and their robust deviation, mm.
    pub edges: usize,
    /// Robust deviation of these ends from the drawn edges, mm.
    pub edge_rms: f64,
    /// Samples whose light gave place and turn, and its robust deviation as a share; 0 where too few were seen and the
    /// ends gave them.
    pub lit: usize,
    /// Robust deviation of that light, as a share of a fully lit sample's.
    pub lit_rms: f64,
    /// How much farther than drawn surfaces reach along the stripe and from shot to shot, mm.
    pub growth: [f64; 2],
    /// Largest distance between neighbouring samples along the stripe and from shot to shot, mm.
    pub step: [f64; 2],
    /// The surface ends themselves, those that locate nothing too.
    pub observations: Vec<Observation>,
    /// The part's sizes against the drawing; `None` where too few edges were seen.
    pub shape: Option<Shape>,
}

/// Rounds of datum and ends, then of datum and light; the pose moves by less than a micrometre in the last.
const ROUNDS: usize = 6;
const LIT_ROUNDS: usize = 4;
/// What all points of a level surface have in common, which no residual shows: their peaks lie at the same phase of the
/// pixels. Share of a sampling step, standard deviation: a thousandth of a pixel.
const LEVEL_BIAS: f64 = 1e-3;

/// Measures the pose. Refuses when too little of the part is seen to determine it.
pub fn measure(
    points: &Ordered,
    drawing: &Drawing,
    start: Rigid<Base, Part>,
    options: &MeasureOptions,
) -> Result<Measured> {
    options.check()?;
    let faces = drawing.faces();
    let edges = EdgeIndex::new(drawing, options.unit());
    if faces.is_empty() || edges.is_empty() {
        return Err(Fault::input("the drawing has no closed shape to measure on")
            .cause("only lines and arcs, or measure = false everywhere")
            .next("draw at least one rectangle, circle or polygon with inside = \"high\""));
    }
    let mut pose = start;
    let moved = |step: &Vector3<f64>| {
        Rigid::<Part, Part>::from_vectors(&Vec3::new(0.0, 0.0, step.z), Vec3::new(step.x, step.y, 0.0))
    };
    let level = |pose: &mut Rigid<Base, Part>, round: usize| -> Result<Datum> {
        let datum = fit_datum(points, &localise(points, drawing, pose, options), &faces, &edges, options, round)?;
        *pose = *pose * datum::moved(&datum.step);
        Ok(datum)
    };
    // Ends of surfaces lead to within some hundredths of a millimetre, the light of the samples beside them from there.
    for round in 0..ROUNDS {
        level(&mut pose, round)?;
        let local = localise(points, drawing, &pose, options);
        let gate = if round < 2 { 2.0 * options.edge_gate_mm } else { options.edge_gate_mm };
        let (observations, step) = surface_ends(points, &local, &faces, &edges, options, gate);
        pose = pose * moved(&fit_edges(observations, &step, options)?.step);
    }
    let mut lit = None;
    for _ in 0..LIT_ROUNDS {
        level(&mut pose, ROUNDS)?;
        let local = localise(points, drawing, &pose, options);
        lit = fit_light(points, &pose, (&local, &faces), &edges, options, None);
        let Some(lit) = &lit else { break };
        pose = pose * moved(&lit.step);
    }
    let datum = level(&mut pose, ROUNDS)?;
    let local = localise(points, drawing, &pose, options);
    let (observations, step) = surface_ends(points, &local, &faces, &edges, options, options.edge_gate_mm);
    let mut plane = fit_edges(observations, &step, options)?;
    // What the ends alone would still move is common to all of them: the light knows better.
    for o in &mut plane.observations {
        o.residual -= o.nx * plane.step.x + o.ny * plane.step.y + (o.x * o.ny - o.y * o.nx) * plane.step.z;
    }
    let shape = measure_shape(&plane.observations, |start| {
        fit_light(points, &pose, (&local, &faces), &edges, options, Some(start))
    });
    let in_plane = lit.as_ref().map_or(plane.covariance, |l| l.covariance);
    let mut covariance = Matrix6::zeros();
    // Datum unknowns are z, rx, ry; edge unknowns x, y, rz.
    for (i, a) in [2, 3, 4].into_iter().enumerate() {
        for (k, b) in [2, 3, 4].into_iter().enumerate() {
            covariance[(a, b)] = datum.covariance[(i, k)];
        }
    }
    covariance[(2, 2)] += (LEVEL_BIAS * step[0].max(step[1])).powi(2);
    for (i, a) in [0, 1, 5].into_iter().enumerate() {
        for (k, b) in [0, 1, 5].into_iter().enumerate() {
            covariance[(a, b)] = in_plane[(i, k)];
        }
    }
    Ok(Measured {
        base_from_part: pose,
        covariance,
        surface_points: datum.used,
        surface_rms: datum.sigma,
        edges: plane.used,
        edge_rms: plane.sigma,
        lit: lit.as_ref().map_or(0, |l| l.samples),
        lit_rms: lit.as_ref().map_or(0.0, |l| l.sigma),
        growth: plane.growth,
        step,
        observations: plane.observations,
        shape,
    })
}
