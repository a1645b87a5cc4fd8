//! In: the points of a scan, a drawing, a first pose. Out: the part's pose by least squares on the
//! points: heights of its faces give height and tilt, ends of its surfaces give place and turn
//! (docs/math.md, Insertion (1) to (4)).
//! Frame and unit: base_from_part; mm, rad; covariance over x y z rx ry rz about the part's own axes.

use super::datum;
use super::datum::{Datum, fit_datum};
use super::in_plane::fit_edges;
use super::lit_edges::{Lit, fit_light};
use super::options::MeasureOptions;
use super::points::{Ordered, localise};
use super::shape::Shape;
use super::sizes::measure_shape;
use super::surface_ends::{Observation, surface_ends};
use crate::fault::{Fault, Result};
use crate::find::model::drawing::Drawing;
use crate::find::model::edge_index::EdgeIndex;
use crate::find::model::face::Face;
use crate::geometry::{Base, Part, Rigid, Vec3};
use nalgebra::{Matrix3, Matrix6, Vector3};

/// A measured pose.
#[derive(Clone, Debug)]
pub struct Measured {
    /// The measured pose, mm.
    pub base_from_part: Rigid<Base, Part>,
    /// 6 x 6 over x y z rx ry rz about the part's own axes, mm and rad.
    pub covariance: Matrix6<f64>,
    /// Number of points that gave height and tilt.
    pub surface_points: usize,
    /// Robust deviation of these points from their faces, mm.
    pub surface_rms: f64,
    /// Number of surface ends at the drawn edges.
    pub edges: usize,
    /// Robust deviation of these ends from the drawn edges, mm.
    pub edge_rms: f64,
    /// Number of samples whose light gave place and turn; 0 where too few were seen and the ends gave them.
    pub lit: usize,
    /// Robust deviation of that light, as a share of a fully lit sample's.
    pub lit_rms: f64,
    /// How much farther than drawn the surfaces reach along the stripe and from shot to shot, mm.
    pub growth: [f64; 2],
    /// Median distance between neighbouring samples along the stripe and from shot to shot, mm.
    pub step: [f64; 2],
    /// All surface ends, including those that do not locate the part.
    pub observations: Vec<Observation>,
    /// The part's sizes against the drawing; `None` where too few edges were seen.
    pub shape: Option<Shape>,
}

/// Rounds of datum and ends, then of datum and light; in the last the pose moves by less than a micrometre.
const ROUNDS: usize = 6;
const LIT_ROUNDS: usize = 4;
/// Error that all points of a level surface share and no residual shows: their peaks lie at the same phase of the
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
    let (faces, edges) = (drawing.faces(), EdgeIndex::new(drawing, options.unit()));
    if faces.is_empty() || edges.is_empty() {
        return Err(Fault::input("the drawing has no closed shape to measure on")
            .cause("only lines and arcs, or measure = false everywhere")
            .next("draw at least one rectangle, circle or polygon with inside = \"high\""));
    }
    let mut part = Measuring { points, drawing, faces: &faces, edges: &edges, options, pose: start };
    // Ends of surfaces bring the pose to within some hundredths of a millimetre; the light of the samples beside them
    // refines it.
    part.follow_ends()?;
    let lit = part.follow_light()?;
    let datum = part.level(ROUNDS)?;
    let local = part.local();
    let (observations, step) = part.ends(&local, options.edge_gate_mm);
    let mut plane = fit_edges(observations, &step, options)?;
    // A step that the ends alone would still make is common to all of them: the light is more accurate.
    for o in &mut plane.observations {
        o.residual -= o.nx * plane.step.x + o.ny * plane.step.y + (o.x * o.ny - o.y * o.nx) * plane.step.z;
    }
    let shape = measure_shape(&plane.observations, options.unit(), |start| part.light(&local, Some(start)));
    let in_plane = lit.as_ref().map_or(plane.covariance, |l| l.covariance);
    Ok(Measured {
        base_from_part: part.pose,
        covariance: covariance(&datum.covariance, &in_plane, LEVEL_BIAS * step[0].max(step[1])),
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

/// A pose while it is fitted to the points.
struct Measuring<'a> {
    points: &'a Ordered,
    drawing: &'a Drawing,
    faces: &'a [Face],
    edges: &'a EdgeIndex,
    options: &'a MeasureOptions,
    pose: Rigid<Base, Part>,
}

impl Measuring<'_> {
    fn local(&self) -> Vec<Option<Vec3>> {
        localise(self.points, self.drawing, &self.pose, self.options)
    }

    /// Brings height and tilt onto the faces.
    fn level(&mut self, round: usize) -> Result<Datum> {
        let datum = fit_datum(self.points, &self.local(), self.faces, self.edges, self.options, round)?;
        self.pose = self.pose * datum::moved(&datum.step);
        Ok(datum)
    }

    fn ends(&self, local: &[Option<Vec3>], gate: f64) -> (Vec<Observation>, [f64; 2]) {
        surface_ends(self.points, local, self.faces, self.edges, self.options, gate)
    }

    fn light(&self, local: &[Option<Vec3>], shape: Option<Vector3<f64>>) -> Option<Lit> {
        fit_light(self.points, &self.pose, (local, self.faces), self.edges, self.options, shape)
    }

    fn follow_ends(&mut self) -> Result<()> {
        for round in 0..ROUNDS {
            self.level(round)?;
            let gate = if round < 2 { 2.0 * self.options.edge_gate_mm } else { self.options.edge_gate_mm };
            let (observations, step) = self.ends(&self.local(), gate);
            self.pose = self.pose * in_plane(&fit_edges(observations, &step, self.options)?.step);
        }
        Ok(())
    }

    /// Refines the pose by light; `None` where too few samples are partly lit.
    fn follow_light(&mut self) -> Result<Option<Lit>> {
        let mut lit = None;
        for _ in 0..LIT_ROUNDS {
            self.level(ROUNDS)?;
            lit = self.light(&self.local(), None);
            let Some(lit) = &lit else { break };
            self.pose = self.pose * in_plane(&lit.step);
        }
        Ok(lit)
    }
}

/// A correction x, y, turn as a motion.
fn in_plane(step: &Vector3<f64>) -> Rigid<Part, Part> {
    Rigid::from_vectors(&Vec3::new(0.0, 0.0, step.z), Vec3::new(step.x, step.y, 0.0))
}

/// Covariance over x y z rx ry rz, from that of the datum (z rx ry), that in the plane (x y rz), and the error that all
/// heights share, mm.
fn covariance(datum: &Matrix3<f64>, in_plane: &Matrix3<f64>, level_bias: f64) -> Matrix6<f64> {
    let mut out = Matrix6::zeros();
    for (part, at) in [(datum, [2, 3, 4]), (in_plane, [0, 1, 5])] {
        for i in 0..3 {
            for k in 0..3 {
                out[(at[i], at[k])] = part[(i, k)];
            }
        }
    }
    out[(2, 2)] += level_bias.powi(2);
    out
}
