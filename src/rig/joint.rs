//! In: `calibration/joint.json`. Out: the joint covariance of all records, and which records it belongs to.
//! Frame and unit: as in the records: mm, rad, px.

use super::{Kind, unsealed};
use nalgebra::DMatrix;
use std::collections::BTreeMap;
use std::path::Path;

/// Joint covariance of the errors of all records, with the names of the parameters.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointCovariance {
    /// Version of the file's format: 1.
    pub format: u32,
    /// Hashes of the records' content ([`super::Calibration::content`]): the covariance belongs to exactly these.
    pub of: BTreeMap<Kind, String>,
    /// `record.parameter`, in the order of the matrix.
    pub parameters: Vec<String>,
    /// Square and symmetric, row by row.
    pub matrix: Vec<Vec<f64>>,
}

/// Joint covariance of a station's records, as loaded.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Joint {
    /// None: the records were calibrated one by one.
    #[default]
    Absent,
    /// A stated covariance; [`super::Rig::joint`] checks whether it belongs to the rig's records.
    Stated(JointCovariance),
    /// A file that cannot be used, with the reason.
    Spoilt(String),
}

impl Joint {
    /// Loads that of a station. A file that cannot be read does not prevent using the records.
    pub(super) fn load(station: &Path) -> Joint {
        let path = station.join("calibration").join("joint.json");
        let text = match crate::files::read_text_if_there(&path) {
            Ok(Some(text)) => text,
            Ok(None) => return Joint::Absent,
            Err(fault) => return Joint::Spoilt(fault.what),
        };
        match unsealed::<JointCovariance>(&text, "joint.json") {
            Ok(c) if c.format != 1 => Joint::Spoilt(format!("joint.json is of format {}, 1 is read", c.format)),
            Ok(c) if !c.whole() => Joint::Spoilt("joint.json holds no covariance".into()),
            Ok(c) => Joint::Stated(c),
            Err(fault) => Joint::Spoilt(fault.what),
        }
    }
}

impl JointCovariance {
    fn whole(&self) -> bool {
        let n = self.parameters.len();
        self.matrix.len() == n
            && self.matrix.iter().all(|row| row.len() == n && row.iter().all(|x| x.is_finite()))
            && (0..n).all(|i| self.matrix[i][i] >= 0.0)
    }

    /// The first of these records (with their content hashes) that the covariance does not belong to. A missing
    /// record counts as such.
    pub(super) fn other(&self, now: &[(Kind, Option<String>)]) -> Option<Kind> {
        let other =
            |(kind, content): &&(Kind, Option<String>)| content.is_none() || self.of.get(kind) != content.as_ref();
        now.iter().find(other).map(|(kind, _)| *kind)
    }

    /// The covariance of some of the parameters, by their indices.
    pub fn of_parameters(&self, at: &[usize]) -> DMatrix<f64> {
        DMatrix::from_fn(at.len(), at.len(), |i, j| self.matrix[at[i]][at[j]])
    }
}
