//! In: pictures of the pointer's spot on a part, the part as scans found it, the station. Out: the height of each
//! spot above the part's surfaces, with its dependence on the calibrations: a measure of the height that does not
//! use the laser plane.
//! Frame and unit: base axes; mm, rad. docs/math.md, Second look (7).

use super::range::{RangeRun, Touched, touched};
use crate::calibrate::pointer::beam::BEAM_NAMES;
use crate::calibrate::pointer::range::{BasePoint, RIG, SharedCovariance};
use crate::fault::{Fault, Result};
use crate::find::look::levers::Lever;
use crate::find::look::looks::Witness;
use crate::find::model::edge_index::EdgeIndex;
use crate::find::{Recipe, Report};
use crate::geometry::Vec3;
use crate::recording::Recording;
use crate::rig::Rig;
use nalgebra::{DMatrix, DVector};

/// A spot farther than this from every surface, in units of the recipe's height gate, lies on something else.
const BESIDE: f64 = 15.0;
/// A spot nearer than this to an edge, in units of the recipe's margin, may be cut by it.
const MARGINS: f64 = 2.0;

/// Heights of the pointer's spots over the surfaces of the part of `report`, and notes on the pictures. Errors:
/// those of [`super::measure_range`]; no spot lies on a surface of the part.
pub(super) fn height_witness(
    recording: &Recording,
    rig: &Rig,
    recipe: &Recipe,
    report: &Report,
) -> Result<(Witness, Vec<String>)> {
    rig.need_hand_eye()?;
    let Touched { report: ranges, points, shared, .. } = touched(recording, rig, &RangeRun::default())?;
    if points.is_empty() {
        return Err(Fault::input("the pointer's pictures have no robot poses")
            .cause("meta.json names no pose_file")
            .next("record the robot's pose with every picture of the pointer"));
    }
    let mut said: Vec<String> =
        ranges.missing.iter().map(|(picture, why)| format!("range: {picture}: {why}")).collect();
    said.extend(ranges.remarks.iter().map(|r| format!("range: {r}")));
    let mut on = Vec::new();
    let part = report.base_from_part;
    for (picture, p) in &points {
        match height(&part.inverse().point(&p.point), recipe) {
            Ok(height) => on.push((height, p)),
            Err(why) => said.push(format!("range: {picture}: {why}; excluded")),
        }
    }
    if on.is_empty() {
        return Err(Fault::refused(format!(
            "none of {} spots lies on a surface of the part: {}",
            points.len(),
            said.join("; ")
        ))
        .cause("the pointer did not hit the part, or hit an edge or a hole of it")
        .next("aim the pointer at plain places of the part's top"));
    }
    Ok((witness(&on, &shared, &part.direction(&Vec3::z()), &part.translation), said))
}

/// Height of a point (part frame) over the nearest surface.
fn height(q: &Vec3, recipe: &Recipe) -> std::result::Result<f64, String> {
    let (drawing, m) = (recipe.drawing(), &recipe.measure);
    let edges = EdgeIndex::new(&drawing, m.margin_mm / 0.5);
    let under = drawing.faces().into_iter().filter(|f| f.material(q.x, q.y)).map(|f| f.z);
    let Some(z) = under.min_by(|a, b| (q.z - a).abs().total_cmp(&(q.z - b).abs())) else {
        return Err("no surface of the part lies under the spot".into());
    };
    if edges.nearest(q.x, q.y, MARGINS * m.margin_mm, |s| s.z == z).is_some() {
        return Err(format!("the spot is nearer than {} mm to an edge", MARGINS * m.margin_mm));
    }
    if (q.z - z).abs() > BESIDE * m.height_gate_mm {
        return Err(format!("the spot lies {:.2} mm off the part's surface: on something else", q.z - z));
    }
    Ok(q.z - z)
}

fn witness(on: &[(f64, &BasePoint)], shared: &SharedCovariance, normal: &Vec3, origin: &Vec3) -> Witness {
    let n = on.len();
    let row = |i: usize, at: usize, k: usize| (normal.transpose() * on[i].1.shared.column(at + k))[0];
    let lever = |name, parameters, at: usize, count: usize| Lever {
        name,
        parameters,
        jacobian: DMatrix::from_fn(n, count, |i, k| row(i, at, k)),
        covariance: Some(DMatrix::from_fn(count, count, |a, b| shared[(at + a, at + b)])),
        supposed: false,
    };
    Witness {
        values: DVector::from_fn(n, |i, _| on[i].0),
        own: DMatrix::from_diagonal(&DVector::from_fn(n, |i, _| (normal.transpose() * on[i].1.own * normal)[0])),
        by_pose: DMatrix::from_fn(n, 6, |i, k| {
            let turned = (on[i].1.point - origin).cross(normal);
            if k < 3 { normal[k] } else { turned[k - 3] }
        }),
        levers: vec![lever("pointer", &BEAM_NAMES[..], 0, RIG), lever("hand-eye", &[], RIG, 6)],
    }
}
