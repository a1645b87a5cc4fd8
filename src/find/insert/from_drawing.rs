//! In: a drawing of a part and what the user states about its insertion. Out: a recipe by which the part is found
//! without ever having been scanned.
//! Frame and unit: part frame; mm, degrees.

use super::recipe::{InsertionSpec, Recipe};
use crate::fault::Result;
use crate::find::measure::construct::{Build, Construction};
use crate::find::model::drawing::Drawing;

/// What a drawing does not state.
#[derive(Clone, Debug)]
pub struct TaskOptions {
    /// Name of the recipe and its files.
    pub name: String,
    /// Edge of a cell of the map that is searched, mm.
    pub cell_mm: f64,
    /// Number of turns about z at which the part looks nearly alike.
    pub alike_turns: u32,
    /// Where the tool goes, and the tolerances of the insertion.
    pub insertion: InsertionSpec,
}

/// A recipe with every gate at its default. Each array of shapes gets a lattice construction. Refuses what
/// [`Recipe::check`] refuses.
pub fn recipe_of(drawing: Drawing, options: &TaskOptions) -> Result<Recipe> {
    let arrays = drawing.shape.iter().filter(|s| s.grid.is_some()).filter_map(|s| s.name.clone());
    let lattice = |of: String| Construction {
        name: format!("all {of}"),
        kind: Build::Lattice,
        of: vec![of],
        by_mm: None,
        along: None,
    };
    let construction = arrays.map(lattice).collect();
    let plain = Recipe::new(&options.name, options.cell_mm, drawing.shape, options.insertion.clone());
    let recipe = Recipe { alike_turns: options.alike_turns, construction, ..plain };
    recipe.check()?;
    Ok(recipe)
}
