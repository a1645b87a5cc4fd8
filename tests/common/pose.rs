//! In: a measured pose of a part and its true one. Out: what they differ by. Frame and unit: the true part's own
//! axes; mm, degrees.

use sheetlight::geometry::{Base, Part, Rigid, Vec3};
use std::path::Path;

/// How far a measured pose lies from the true one.
#[derive(Clone, Copy, Debug)]
pub struct Off {
    /// x, y, z, mm.
    pub by: Vec3,
    /// Turn about z, and about whichever axis; a half turn counts in full.
    pub turn_deg: f64,
    pub angle_deg: f64,
}

impl Off {
    pub fn of(found: &Rigid<Base, Part>, truth: &Rigid<Base, Part>) -> Off {
        let d = truth.inverse() * *found;
        let turn = d.rotation_vector();
        Off { by: d.translation, turn_deg: turn.z.to_degrees(), angle_deg: turn.norm().to_degrees() }
    }
    pub fn in_plane(&self) -> f64 {
        self.by.xy().norm()
    }
    pub fn in_height(&self) -> f64 {
        self.by.z.abs()
    }
}

/// The pose that a truth.json of a scanned part holds.
pub fn truth(folder: &Path) -> Rigid<Base, Part> {
    let text = std::fs::read_to_string(folder.join("truth.json")).unwrap();
    let value: serde_json::Value = serde_json::from_str(&text).unwrap();
    serde_json::from_value(value["base_T_part"].clone()).unwrap()
}
