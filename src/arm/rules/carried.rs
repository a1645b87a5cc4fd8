//! What the flange carries: the named points whose speed and keep-outs are judged; flange frame, mm.

use super::straight::Straight;
use crate::geometry::{Base, Flange, Rigid, Vec3};

/// A point that is fixed to the flange.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Point {
    name: &'static str,
    at: Vec3,
}

/// The flange's origin, the tool's tip and the sensor head, and what of them was not described.
#[derive(Clone, Debug, PartialEq)]
pub struct Carried {
    points: Vec<Point>,
    unknown: Vec<String>,
}

impl Carried {
    /// `tool`: its tip; `None` if none is described. `head`: points of the sensor head, empty if nothing of it is
    /// on the flange; an error gives the reason why it is unknown.
    pub fn new(tool: Option<Vec3>, head: std::result::Result<Vec<Vec3>, String>) -> Carried {
        let mut points = vec![Point { name: "the flange", at: Vec3::zeros() }];
        let mut unknown = Vec::new();
        match tool {
            Some(at) => points.push(Point { name: "the tool's tip", at }),
            None => unknown.push("the tool: none is described in station.toml".to_owned()),
        }
        match head {
            Ok(head) => points.extend(head.into_iter().map(|at| Point { name: "the sensor head", at })),
            Err(why) => unknown.push(format!("the sensor head: {why}")),
        }
        Carried { points, unknown }
    }

    /// What is not judged because it was not described, in words.
    pub fn unknown(&self) -> &[String] {
        &self.unknown
    }

    /// The points, the flange's origin first.
    pub fn points(&self) -> impl Iterator<Item = &Vec3> {
        self.points.iter().map(|p| &p.at)
    }

    /// Distance of the farthest point from the flange's origin, mm.
    pub fn lever_mm(&self) -> f64 {
        self.points().map(|p| p.norm()).fold(0.0, f64::max)
    }

    /// Greatest speed of any of the points along a path, in mm per unit of time if the whole path takes one unit.
    pub fn fastest(&self, way: &Straight) -> f64 {
        let worse = |a: f64, b: f64| if b.is_nan() { b } else { a.max(b) };
        self.points().map(|p| way.fastest(p)).fold(0.0, worse)
    }

    /// The point that moved farthest, and its distance, mm.
    pub fn moved(&self, from: &Rigid<Base, Flange>, to: &Rigid<Base, Flange>) -> (&'static str, f64) {
        let moved = self.points.iter().map(|p| (p.name, (to.point(&p.at) - from.point(&p.at)).norm()));
        moved.fold(("the flange", 0.0), |a, b| if b.1 > a.1 { b } else { a })
    }
}
