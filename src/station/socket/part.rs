//! In: a report of a found part, as it is or from its file. Out: what a robot or a PLC asks of it: poses, gates,
//! standard deviations.
//! Frame and unit: base frame; mm, degrees.

use super::words::{Code, Of, Which, Wrong};
use crate::fault::{Fault, Result};
use crate::find::Report;
use crate::geometry::{Base, Rigid, Tool};
use crate::robot::Convention;
use crate::station::settings::ToolSpec;
use serde_json::Value;
use std::path::Path;

/// A part that was found, or that missed a gate.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Name of its recipe.
    pub recipe: String,
    /// Frame of the poses.
    pub frame: String,
    /// Score of the match, 0 to 1.
    pub score: f64,
    /// Each gate with its result.
    pub gates: Vec<(String, bool)>,
    /// Standard deviations along the part's x, y, z, mm.
    pub sigma_mm: [f64; 3],
    /// The same of the turns about them, degrees.
    pub sigma_deg: [f64; 3],
    /// The gates that were missed, in words.
    pub reasons: Vec<String>,
    /// The tool at approach, insertion and retract; `None` if a gate was missed.
    pub poses: Option<[Rigid<Base, Tool>; 3]>,
}

/// The fields of a report's file that are read. A number that is missing there is not finite.
#[derive(serde::Deserialize)]
struct Written {
    recipe: String,
    frame: String,
    reasons: Vec<String>,
    poses: Option<Poses>,
    sigma_mm: [Option<f64>; 3],
    sigma_deg: [Option<f64>; 3],
    gates: Vec<Gate>,
    found: Value,
}

#[derive(serde::Deserialize)]
struct Poses {
    approach: Pose,
    insertion: Pose,
    retract: Pose,
}

#[derive(serde::Deserialize)]
struct Pose {
    base_from_tool: Rigid<Base, Tool>,
}

#[derive(serde::Deserialize)]
struct Gate {
    name: String,
    passed: bool,
}

impl Part {
    /// The part of a report.
    pub fn of(report: &Report) -> Part {
        Part {
            recipe: report.recipe.clone(),
            frame: report.frame.clone(),
            score: report.found.score,
            gates: report.gates.iter().map(|g| (g.name.to_owned(), g.passed)).collect(),
            sigma_mm: report.sigma_mm,
            sigma_deg: report.sigma_deg,
            reasons: report.reasons.clone(),
            poses: report.poses.as_ref().map(|p| [&p.approach, &p.insertion, &p.retract].map(|p| p.base_from_tool)),
        }
    }

    /// The part of a report's file.
    ///
    /// # Errors
    /// The file cannot be read, or is no such report.
    pub fn load(path: &Path) -> Result<Part> {
        let text = crate::files::read_text(path)?;
        let read: Written = serde_json::from_str(&text).map_err(|e| {
            Fault::input(format!("{}: is not a report of a part that was found: {e}", path.display()))
                .cause("another version wrote it, or it was changed by hand")
                .next("look for the part again")
        })?;
        let finite = |x: Option<f64>| x.unwrap_or(f64::INFINITY);
        Ok(Part {
            recipe: read.recipe,
            frame: read.frame,
            score: read.found["score"].as_f64().unwrap_or(0.0),
            gates: read.gates.into_iter().map(|g| (g.name, g.passed)).collect(),
            sigma_mm: read.sigma_mm.map(finite),
            sigma_deg: read.sigma_deg.map(finite),
            reasons: read.reasons,
            poses: read.poses.map(|p| [p.approach, p.insertion, p.retract].map(|p| p.base_from_tool)),
        })
    }

    /// A pose for the controller, in a notation; `tool` is what the flange carries.
    ///
    /// # Errors
    /// There is no pose, it is not in the base frame, or the flange is asked for and the tool unknown.
    pub fn give(
        &self,
        which: Which,
        of: Of,
        tool: Option<ToolSpec>,
        notation: Convention,
    ) -> std::result::Result<Vec<f64>, Wrong> {
        if self.frame != "base" {
            let what = format!("the part lies in the frame '{}', not in the robot's base", self.frame);
            return Err(Wrong::new(Code::Refused, what));
        }
        let Some([approach, insertion, retract]) = &self.poses else {
            return Err(Wrong::new(Code::Refused, format!("no pose: {}", self.reasons.join("; "))));
        };
        let pose = match which {
            Which::Approach => approach,
            Which::Insertion => insertion,
            Which::Retract => retract,
        };
        match (of, tool) {
            (Of::Tool, _) => Ok(notation.write(pose)),
            (Of::Flange, Some(tool)) => Ok(notation.write(&(*pose * tool.flange_from_tool.inverse()))),
            (Of::Flange, None) => {
                Err(Wrong::new(Code::Failed, "station.toml has no [tool]: where the flange stands is not known"))
            }
        }
    }
}
