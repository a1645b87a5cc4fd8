//! In: nothing. Out: a drawing of a part to make a recipe of, and what was read of it.
//! Frame and unit: part frame, mm, degrees.

use super::RecipeText;
use serde::{Deserialize, Serialize};
use ts_rs::TS;

/// A drawing, and what it is for.
#[derive(Clone, Debug, PartialEq, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct DrawingAsk {
    /// What the recipe is called.
    pub name: String,
    /// ASCII DXF.
    pub text: String,
    /// mm, inch, cm, m, um, mil or foot, where the drawing names none; null: the one it names.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub unit: Option<String>,
    /// Layers that hold the part's edges; none: all that are shown.
    #[serde(default)]
    pub layers: Vec<String>,
    /// The insertion datum in the drawing, in its unit; null: the middle of the largest outline's box.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub origin: Option<[f64; 2]>,
    /// How many turns make the part look nearly alike.
    pub alike_turns: u32,
    /// Edge of a cell of the map that is searched, mm.
    pub cell_mm: f64,
    /// What the insertion bears in the plane, mm.
    pub tolerance_mm: f64,
    /// What it bears as a turn, degrees.
    pub tolerance_deg: f64,
    /// The tool's way above the insertion pose before and after, mm.
    pub approach_mm: f64,
    /// It takes the place of the station's own recipe of that name.
    #[serde(default)]
    pub replace: bool,
}

/// A recipe's text, and what changes of its constructed points.
#[derive(Clone, Debug, PartialEq, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct PointsChange {
    /// TOML; it need not be stored.
    pub text: String,
    /// What changes.
    pub change: PointChange,
}

/// What changes of a recipe's constructed points.
#[derive(Clone, Debug, PartialEq, Deserialize, TS)]
#[serde(rename_all = "snake_case")]
pub enum PointChange {
    /// One more, behind those that it may be built of.
    Add(NewPoint),
    /// One less.
    TakeOut {
        /// Which one.
        name: String,
    },
    /// Where the tool goes.
    Choose {
        /// Which one; null: the part's own place.
        name: Option<String>,
    },
}

/// A point to be constructed.
#[derive(Clone, Debug, PartialEq, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct NewPoint {
    /// By which later ones and the insertion name it.
    pub name: String,
    /// midpoint, line, intersection, offset or lattice.
    pub kind: String,
    /// Names of shapes, or of points before it.
    pub of: Vec<String>,
    /// Of an offset: the line or lattice that gives the direction.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub along: Option<String>,
    /// Of an offset: along and across, mm.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub by_mm: Option<[f64; 2]>,
}

/// A recipe's text after a change of its points.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct PointsChanged {
    /// TOML, with all comments that it had.
    pub text: String,
    /// Its points now.
    pub points: Vec<RecipePoint>,
}

/// A recipe's text that is being written.
#[derive(Clone, Debug, PartialEq, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct PointsOf {
    /// TOML.
    pub text: String,
}

/// A point of a recipe.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct RecipePoint {
    /// By which constructions and the insertion name it.
    pub name: String,
    /// In the part's frame, as drawn, mm.
    pub at: [f64; 2],
    /// shape, grid, or the construction's: midpoint, line, intersection, offset, lattice.
    pub kind: String,
    /// The tool goes there.
    pub chosen: bool,
}

/// What was read.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct DrawingRead {
    /// The recipe, stored.
    pub recipe: RecipeText,
    /// Width and height of what was drawn, mm.
    pub size_mm: [f64; 2],
    /// What was passed over, and what to look at.
    pub notes: Vec<String>,
}
