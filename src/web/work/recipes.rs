//! In: recipes that ship with the program, and those of a station. Out: their texts by name; a broken one is not stored.
//! Frame and unit: part frame, mm, degrees.

use super::place::Place;
use crate::fault::{Fault, Result};
use crate::find::Recipe;
use crate::web::guard::plain;
use crate::web::message::RecipeText;
use std::path::PathBuf;

const SHIPPED: [(&str, &str); 4] = [
    ("dimm", include_str!("../../../data/recipes/dimm.toml")),
    ("flash", include_str!("../../../data/recipes/flash.toml")),
    ("led", include_str!("../../../data/recipes/led.toml")),
    ("osc", include_str!("../../../data/recipes/osc.toml")),
];

/// All of them: the station's own first, in the order of their names; a station's own replaces a shipped one of that name.
pub fn recipes(place: &Place) -> Result<Vec<RecipeText>> {
    let folder = place.recipes();
    let mut own: Vec<RecipeText> = Vec::new();
    for entry in std::fs::read_dir(&folder).into_iter().flatten().flatten() {
        let path = entry.path();
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if path.extension().is_some_and(|e| e == "toml") && plain(&name) {
            let text = crate::files::read_text(&path)?;
            own.push(RecipeText { title: title(&text), name, shipped: false, text });
        }
    }
    own.sort_by(|a, b| a.name.cmp(&b.name));
    for (name, text) in SHIPPED {
        if !own.iter().any(|r| r.name == name) {
            own.push(RecipeText { name: name.into(), title: title(text), shipped: true, text: text.into() });
        }
    }
    Ok(own)
}

fn title(text: &str) -> String {
    Recipe::parse(text).map_or_else(|_| String::new(), |r| if r.title.is_empty() { r.name } else { r.title })
}

/// Where a station's own recipe lies. Errors: a name that is none.
pub fn recipe_path(place: &Place, name: &str) -> Result<PathBuf> {
    if !plain(name) {
        return Err(Fault::usage(format!("{name:?} is no name for a recipe"))
            .cause("names have letters, digits, blanks and . _ - + ( )")
            .next("choose another name"));
    }
    Ok(place.recipes().join(format!("{name}.toml")))
}

/// Checks and stores one.
pub fn save_recipe(place: &Place, recipe: &RecipeText) -> Result<()> {
    let path = recipe_path(place, &recipe.name)?;
    Recipe::parse(&recipe.text)?;
    crate::files::make_folder(&place.recipes())?;
    crate::files::write(&path, recipe.text.as_bytes())
}

/// One of them, checked.
pub(super) fn load(place: &Place, name: &str) -> Result<Recipe> {
    let all = recipes(place)?;
    let found = all.iter().find(|r| r.name == name).ok_or_else(|| {
        Fault::input(format!("{name:?}: is no recipe of this station")).next("choose one from the list")
    })?;
    Recipe::parse(&found.text).map_err(|e| e.at(name))
}
