//! In: what was found out about a part. Out: the report of it, with the poses for the robot.
//! Frame and unit: the scan's frame; mm, degrees; sigmas along the part's own axes.

use super::budget::Budget;
use super::places::Place;
use super::rim::CutOff;
use super::verdict::{Agreement, TurnVote};
use crate::fault::Gate;
use crate::find::look::looks::Disagreement;
use crate::find::look::size_check::SizeCheck;
use crate::find::measure::construct::Built;
use crate::find::search::full::Match;
use crate::geometry::{Base, Part, Rigid, Tool};
use crate::scan::HeightMap;

/// A pose for the robot.
#[derive(Clone, Debug, serde::Serialize)]
pub struct RobotPose {
    /// The tool's pose in the base, mm.
    pub base_from_tool: Rigid<Base, Tool>,
    /// Notation of `numbers`, see [`crate::robot::Convention::name`].
    pub convention: &'static str,
    /// One label a number, with its unit.
    pub labels: &'static [&'static str],
    /// The pose as the robot writes it, in the order of the labels.
    pub numbers: Vec<f64>,
}

/// The poses of one insertion.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Poses {
    /// The tool's pose when the component is inserted.
    pub insertion: RobotPose,
    /// The insertion pose raised along the part's z by the recipe's `approach_mm`.
    pub approach: RobotPose,
    /// The insertion pose raised along the part's z by the recipe's `retract_mm`.
    pub retract: RobotPose,
}

/// Everything that was found out about a part. `poses` is present only where every gate was passed.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Report {
    /// Name of the part's recipe.
    pub recipe: String,
    /// Frame of every pose here: the scan's. `base` in other names means this frame.
    pub frame: String,
    /// True where every gate was passed.
    pub passed: bool,
    /// Which gates failed, in words; empty when passed.
    pub reasons: Vec<String>,
    /// Where the tool goes; `None` where a gate failed.
    pub poses: Option<Poses>,
    /// True where 3 sigma, in the plane and as a turn, lie within the recipe's tolerances.
    pub within_tolerance: bool,
    /// Tolerance of the recipe's insertion in the plane, mm.
    pub tolerance_mm: f64,
    /// Tolerance of the recipe's insertion for any turn, degrees.
    pub tolerance_deg: f64,
    /// One standard deviation along x, y, z of the part, mm.
    pub sigma_mm: [f64; 3],
    /// One standard deviation of the turns about x, y, z of the part, degrees.
    pub sigma_deg: [f64; 3],
    /// What each source of error adds; of several scans, the budget of the first.
    pub budget: Budget,
    /// Every gate that was judged, passed or not.
    pub gates: Vec<Gate>,
    /// The part's pose as measured, in the scan's frame, mm; of several scans, the agreed one.
    pub base_from_part: Rigid<Base, Part>,
    /// The match in the height map at which the measurement started; px of the map.
    pub found: Match,
    /// Every place of the map that looks like the part, best first; empty unless all were requested.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub all: Vec<Place>,
    /// How well the points agree with the drawing at the measured pose.
    pub agreement: Agreement,
    /// Votes on each other turn at which the part looks nearly alike.
    pub turns: Vec<TurnVote>,
    /// What was constructed on the part; constructions that could not be built are absent.
    pub constructions: Vec<Built>,
    /// Distance between the two-pin construction and the lattice fit, mm.
    pub disagreement_mm: Option<f64>,
    /// The distance expected from the noise of the two, mm.
    #[serde(default)]
    pub disagreement_noise_mm: Option<f64>,
    /// Number of surface ends at the drawn edges that were measured.
    pub edges: usize,
    /// Robust deviation of these ends from the drawn edges, mm.
    pub edge_rms_mm: f64,
    /// Number of points that gave height and tilt.
    pub surface_points: usize,
    /// Robust deviation of these points from their surfaces, mm.
    pub surface_rms_mm: f64,
    /// How much farther than drawn the surfaces reach, along the stripe and from shot to shot, mm.
    pub growth_mm: [f64; 2],
    /// Further remarks for the reader, one sentence each.
    pub notes: Vec<String>,
    /// What the part's own sizes indicate about scale, steps and shear; `None` where too few edges were seen or no
    /// station is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sizes: Option<SizeCheck>,
    /// What further scans of the part showed; `None`: one scan alone, not cross-checked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub looks: Option<Disagreement>,
    /// How far, and past which side, the part extends beyond the rim of the scan, where a gate failed because of that.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cut_off: Option<CutOff>,
    /// The part's pose corrected by the construction; the tool's poses follow from it.
    #[serde(skip)]
    pub base_from_constructed: Rigid<Base, Part>,
    /// The height map that was searched.
    #[serde(skip)]
    pub map: HeightMap,
}
