//! In: the points of a scan near a part. Out: the part's height and tilt from the points on its faces
//! (docs/math.md, Insertion (1)).
//! Frame and unit: a correction in the part frame: z mm, turns about x and y rad.

use super::options::MeasureOptions;
use super::points::{Ordered, localise};
use super::robust::robust;
use crate::fault::{Fault, Result};
use crate::find::model::drawing::Drawing;
use crate::find::model::edge_index::EdgeIndex;
use crate::find::model::face::Face;
use crate::geometry::{Base, Part, Rigid, Vec3};
use nalgebra::{Matrix3, Vector3};

/// Fewer points do not give a datum.
const MIN_SURFACE: usize = 60;

pub(in crate::find) struct Datum {
    pub step: Vector3<f64>,
    pub covariance: Matrix3<f64>,
    pub used: usize,
    pub sigma: f64,
}

/// A level start laid onto the part's faces. A long part rises by more than any gate from end to end at a degree of tilt:
/// what lies at its ends can be told only afterwards. As it was where too few points lie on the faces.
pub(in crate::find) fn laid(
    points: &Ordered,
    drawing: &Drawing,
    start: Rigid<Base, Part>,
    options: &MeasureOptions,
) -> Rigid<Base, Part> {
    // The gate grows along the part with each round's tilt.
    const ROUNDS: usize = 4;
    let (faces, edges) = (drawing.faces(), EdgeIndex::new(drawing, options.unit()));
    let mut pose = start;
    for _ in 0..ROUNDS {
        let Ok(d) = fit_datum(points, &localise(points, drawing, &pose, options), &faces, &edges, options, 0) else {
            break;
        };
        pose = pose * moved(&d.step);
    }
    pose
}

/// A datum's correction as a motion.
pub(in crate::find) fn moved(step: &Vector3<f64>) -> Rigid<Part, Part> {
    Rigid::from_vectors(&Vec3::new(step.y, step.z, 0.0), Vec3::new(0.0, 0.0, step.x))
}

/// Height and tilt from the points inside the faces.
pub(in crate::find) fn fit_datum(
    points: &Ordered,
    local: &[Option<Vec3>],
    faces: &[Face],
    edges: &EdgeIndex,
    options: &MeasureOptions,
    round: usize,
) -> Result<Datum> {
    let gate = if round == 0 { 4.0 * options.height_gate_mm } else { 2.0 * options.height_gate_mm };
    let mut rows: Vec<(Vector3<f64>, f64, u32)> = Vec::new();
    for (i, q) in local.iter().enumerate() {
        let Some(q) = q else { continue };
        let Some(face) = faces.iter().filter(|f| (q.z - f.z).abs() < gate).find(|f| f.material(q.x, q.y)) else {
            continue;
        };
        if edges.nearest(q.x, q.y, options.margin_mm, |s| s.z == face.z).is_none() {
            rows.push((Vector3::new(1.0, q.y, -q.x), q.z - face.z, points.row[i]));
        }
    }
    if rows.len() < MIN_SURFACE {
        return Err(Fault::refused(format!(
            "{} points lie on the part's level surfaces (to {} mm, from height_gate_mm), at least {MIN_SURFACE} are needed",
            rows.len(),
            gate
        ))
        .cause("the part is hidden, is another one, or the search was misled")
        .next("look at the picture of the match, then scan the part again"));
    }
    robust(&rows, &[], 0.005 * options.unit())
        .map(|f| Datum { step: f.step, covariance: f.covariance, used: f.used, sigma: f.sigma })
        .ok_or_else(|| {
            Fault::refused("the seen surfaces do not determine height and tilt")
                .cause("they lie on one line")
                .next("scan more of the part")
        })
}
