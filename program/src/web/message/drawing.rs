//! In: nothing. Out: a drawing of a part to make a recipe from, and what was read from it.
//! Frame and unit: part frame, mm, degrees.

use super::RecipeText;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use ts_rs::TS;

/// A drawing, and the recipe to make from it.
#[derive(Clone, Debug, PartialEq, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DrawingAsk {
    /// Name of the recipe.
    pub name: String,
    /// ASCII DXF.
    pub text: String,
    /// Unit if the drawing states none: mm, inch, cm, m, um, mil or foot; null: the unit stated in the drawing.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub unit: Option<String>,
    /// Layers that contain the part's edges; empty: all visible layers.
    #[serde(default)]
    pub layers: Vec<String>,
    /// The insertion datum in the drawing, in its unit; null: the middle of the largest outline's bounding box.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub origin: Option<[f64; 2]>,
    /// Number of rotations at which the part looks nearly alike.
    pub alike_turns: u32,
    /// Cell size of the map that is searched, mm.
    pub cell_mm: f64,
    /// Tolerance of the insertion in the plane, mm.
    pub tolerance_mm: f64,
    /// Tolerance of its rotation, degrees.
    pub tolerance_deg: f64,
    /// Distance of the tool above the insertion pose before and after the insertion, mm.
    pub approach_mm: f64,
    /// Replaces the station's recipe of that name.
    #[serde(default)]
    pub replace: bool,
}

/// A recipe's text, and the change to its constructed points.
#[derive(Clone, Debug, PartialEq, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointsChange {
    /// TOML; it need not be stored.
    pub text: String,
    /// The change.
    pub change: PointChange,
}

/// A change to a recipe's constructed points.
#[derive(Clone, Debug, PartialEq, Deserialize, TS, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PointChange {
    /// Adds a point, after those that it may be built from.
    Add(NewPoint),
    /// Removes a point.
    TakeOut {
        /// Name of the point.
        name: String,
    },
    /// Selects the point that the tool goes to.
    Choose {
        /// Name of the point; null: the part's datum.
        name: Option<String>,
    },
}

/// A point to be constructed.
#[derive(Clone, Debug, PartialEq, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NewPoint {
    /// The name by which later points and the insertion refer to it.
    pub name: String,
    /// midpoint, line, intersection, offset or lattice.
    pub kind: String,
    /// Names of shapes, or of earlier points.
    pub of: Vec<String>,
    /// For an offset: the line or lattice that gives the direction.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub along: Option<String>,
    /// For an offset: distance along and across that direction, mm.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub by_mm: Option<[f64; 2]>,
}

/// A recipe's text after a change of its points.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct PointsChanged {
    /// TOML, with all its comments.
    pub text: String,
    /// Its points after the change.
    pub points: Vec<RecipePoint>,
}

/// The text of a recipe being edited.
#[derive(Clone, Debug, PartialEq, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointsOf {
    /// TOML.
    pub text: String,
}

/// A point of a recipe.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct RecipePoint {
    /// The name by which constructions and the insertion refer to it.
    pub name: String,
    /// Position in the part's frame, as drawn, mm.
    pub at: [f64; 2],
    /// shape, grid, or the kind of construction: midpoint, line, intersection, offset, lattice.
    pub kind: String,
    /// The tool goes to this point.
    pub chosen: bool,
}

/// What was read from a drawing.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct DrawingRead {
    /// The recipe, as stored.
    pub recipe: RecipeText,
    /// Width and height of the drawn part, mm.
    pub size_mm: [f64; 2],
    /// What was skipped in the drawing, and what to check.
    pub notes: Vec<String>,
}
