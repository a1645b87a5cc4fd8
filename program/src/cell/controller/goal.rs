//! In: pose data in all the forms that a controller accepts. Out: a pose or joints; and poses in the controller's
//! form.
//! Frame and unit: mm and degrees as Denso writes them: P = X Y Z RX RY RZ Fig, T = X Y Z, orient, approach, Fig, J
//! = joints.

use super::super::kinematics::{Joints, figure};
use super::{BAD_POSE, Outcome};
use sheetlight::bcap::Variant;
use sheetlight::geometry::{Base, Flange, Mat3, Rigid, Vec3};
use sheetlight::robot::Convention;
use std::collections::BTreeMap;

/// Target of a motion.
#[derive(Clone, Copy, Debug)]
pub enum Goal {
    Pose(Rigid<Base, Flange>),
    Joints(Joints),
}

/// Reads pose data; variables (`P1`) are looked up.
pub fn read(data: &Variant, variables: &BTreeMap<String, Variant>) -> Result<Goal, Outcome> {
    match data {
        Variant::Text(text) => from_text(text, variables),
        Variant::Variants(items) => {
            let value = items.first().ok_or(BAD_POSE)?;
            if let Variant::Variants(_) | Variant::Text(_) = value {
                return read(value, variables);
            }
            let kind = match items.get(1) {
                Some(Variant::Text(kind)) => kind.trim().to_ascii_uppercase(),
                Some(other) => match other.as_f64() {
                    Some(0.0) => "P".into(),
                    Some(1.0) => "T".into(),
                    Some(2.0) => "J".into(),
                    _ => return Err(BAD_POSE),
                },
                None => "P".into(),
            };
            numbers(&kind, &value.as_f64s().ok_or(Outcome::BAD_TYPE)?)
        }
        _ => Err(Outcome::BAD_TYPE),
    }
}

fn from_text(text: &str, variables: &BTreeMap<String, Variant>) -> Result<Goal, Outcome> {
    let text = text.trim();
    // The pass motion precedes the pose: @P, @E, @0, @100.
    let body = if text.starts_with('@') { text.split_once(' ').ok_or(BAD_POSE)?.1.trim() } else { text };
    if let Some((kind, rest)) = body.split_once('(') {
        let list = rest.strip_suffix(')').ok_or(BAD_POSE)?;
        let values: Option<Vec<f64>> = list.split(',').map(|n| n.trim().parse().ok()).collect();
        return numbers(&kind.trim().to_ascii_uppercase(), &values.ok_or(BAD_POSE)?);
    }
    let name = body.to_ascii_uppercase();
    let value = variables.get(&name).and_then(Variant::as_f64s).ok_or(BAD_POSE)?;
    numbers(&name[..1], &value)
}

fn numbers(kind: &str, n: &[f64]) -> Result<Goal, Outcome> {
    if n.iter().any(|x| !x.is_finite()) {
        return Err(BAD_POSE);
    }
    match (kind, n.len()) {
        ("P", 6 | 7) => Convention::Denso.read(&n[..6]).map(Goal::Pose).map_err(|_| BAD_POSE),
        ("T", 9 | 10) => {
            let (y, z) = (Vec3::new(n[3], n[4], n[5]), Vec3::new(n[6], n[7], n[8]));
            let rotation = Mat3::from_columns(&[y.cross(&z), y, z]);
            if sheetlight::geometry::repair(&rotation).is_err() {
                return Err(BAD_POSE);
            }
            Ok(Goal::Pose(Rigid::new(rotation, Vec3::new(n[0], n[1], n[2]))))
        }
        ("J", 6..=8) => Ok(Goal::Joints(std::array::from_fn(|k| n[k].to_radians()))),
        _ => Err(BAD_POSE),
    }
}

/// X Y Z RX RY RZ Fig.
pub fn position(pose: &Rigid<Base, Flange>, fig: i32) -> Vec<f64> {
    let mut out = Convention::Denso.write(pose);
    out.push(f64::from(fig));
    out
}

/// X Y Z, y axis, z axis, Fig.
pub fn transform(pose: &Rigid<Base, Flange>, fig: i32) -> Vec<f64> {
    let (t, y, z) = (pose.translation, pose.rotation.column(1), pose.rotation.column(2));
    let mut out = vec![t.x, t.y, t.z, y[0], y[1], y[2], z[0], z[1], z[2]];
    out.push(f64::from(fig));
    out
}

/// Joints as a controller writes them: eight numbers, the last two 0.
pub fn joints(j: &Joints) -> Vec<f64> {
    j.iter().map(|a| a.to_degrees()).chain([0.0, 0.0]).collect()
}

/// The figure of the joints.
pub fn figure_of(j: &Joints) -> i32 {
    figure(j)
}
