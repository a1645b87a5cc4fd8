//! In: a drawing of a part and what a person says about its insertion. Out: a recipe by which the part is found without
//! ever having been scanned. Frame and unit: part frame; mm, degrees.

use super::construct::{Build, Construction};
use super::drawing::Drawing;
use super::measure::MeasureOptions;
use super::recipe::{Gates, InsertionSpec, Recipe, RobotSpec};
use super::scene::Kind;
use crate::fault::Result;

/// What a drawing does not say.
#[derive(Clone, Debug)]
pub struct TaskOptions {
    pub name: String,
    /// Edge of a cell of the map that is searched, mm.
    pub cell_mm: f64,
    /// How many turns about z make the part look nearly alike.
    pub alike_turns: u32,
    pub tolerance_mm: f64,
    pub tolerance_deg: f64,
    pub approach_mm: f64,
    pub retract_mm: f64,
}

/// A recipe with every gate at its default. Each array of shapes is offered as a lattice fit.
pub fn recipe_of(drawing: Drawing, options: &TaskOptions) -> Result<Recipe> {
    let arrays = drawing.shape.iter().filter(|s| s.grid.is_some()).filter_map(|s| s.name.clone());
    let lattice = |of: String| Construction {
        name: format!("all {of}"),
        kind: Build::Lattice,
        of: vec![of],
        by_mm: None,
        along: None,
    };
    let recipe = Recipe {
        format: 1,
        name: options.name.clone(),
        title: String::new(),
        cell_mm: options.cell_mm,
        layers: vec![Kind::Height],
        alike_turns: options.alike_turns,
        search: Default::default(),
        model: Default::default(),
        measure: MeasureOptions::default(),
        construction: arrays.map(lattice).collect(),
        shape: drawing.shape,
        insertion: InsertionSpec {
            construction: "pose".into(),
            two_pin: None,
            lattice: None,
            offset_mm: [0.0; 3],
            turn_deg: 0.0,
            approach_mm: options.approach_mm,
            retract_mm: options.retract_mm,
            tolerance_mm: options.tolerance_mm,
            tolerance_deg: options.tolerance_deg,
        },
        gates: Gates::default(),
        robot: RobotSpec::default(),
    };
    recipe.check()?;
    Ok(recipe)
}
