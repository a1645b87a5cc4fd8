//! In: recipes that ship with the program, and those of a station. Out: their texts by name; a broken one is not stored.
//! Frame and unit: part frame, mm, degrees.

use super::place::Place;
use crate::fault::{Fault, Result};
use crate::find::dxf::{self, DxfOptions, Unit};
use crate::find::insert::recipe::InsertionSpec;
use crate::find::measure::construct::nominal;
use crate::find::{Recipe, TaskOptions, recipe_of};
use crate::web::guard::plain;
use crate::web::message::{DrawingAsk, DrawingRead, RecipePoint, RecipeText};
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

/// Every point by which a recipe's text can say where the tool goes: shapes with names, and what is constructed of them.
///
/// # Errors
/// The text is no recipe.
pub fn points(text: &str) -> Result<Vec<RecipePoint>> {
    let recipe = Recipe::parse(text)?;
    let drawing = recipe.drawing();
    let mut out = Vec::new();
    for (i, shape) in drawing.shape.iter().enumerate() {
        let Some(name) = &shape.name else { continue };
        for element in 0..shape.elements() {
            let word = match shape.grid {
                Some(g) => {
                    format!("{name}[{},{}]", element % g.count[0] as usize + 1, element / g.count[0] as usize + 1)
                }
                None => name.clone(),
            };
            out.push(RecipePoint {
                name: word,
                at: drawing.centre_of(i, element),
                kind: "shape".into(),
                chosen: false,
            });
        }
        if shape.grid.is_some() {
            // A lattice is constructed of the whole grid.
            out.push(RecipePoint {
                name: name.clone(),
                at: drawing.centre_of(i, 0),
                kind: "grid".into(),
                chosen: false,
            });
        }
    }
    for (c, built) in recipe.construction.iter().zip(nominal(&recipe.construction, &drawing)?) {
        let kind = serde_json::to_value(c.kind).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default();
        let at = [built.nominal.x, built.nominal.y];
        out.push(RecipePoint { name: c.name.clone(), at, kind, chosen: recipe.insertion.construction == c.name });
    }
    Ok(out)
}

/// Makes a recipe of a drawing and stores it.
pub fn from_drawing(place: &Place, ask: &DrawingAsk) -> Result<DrawingRead> {
    let unit = ask.unit.as_deref().map(str::parse::<Unit>).transpose();
    let unit = unit.map_err(|e| Fault::usage(e).next("choose one of the units"))?;
    let options = DxfOptions { unit, layers: ask.layers.clone(), origin: ask.origin };
    let read = dxf::read(ask.text.as_bytes(), &options)?;
    let [x0, y0, x1, y1] = read.drawing.bounds();
    let insertion = InsertionSpec::at_the_part((ask.tolerance_mm, ask.tolerance_deg), ask.approach_mm, ask.approach_mm);
    let (name, cell_mm, alike_turns) = (ask.name.clone(), ask.cell_mm, ask.alike_turns);
    let made = recipe_of(read.drawing, &TaskOptions { name, cell_mm, alike_turns, insertion })?;
    let text = toml::to_string(&made).expect("plain data");
    let recipe = RecipeText { name: ask.name.clone(), title: title(&text), shipped: false, text };
    save_recipe(place, &recipe)?;
    Ok(DrawingRead {
        recipe,
        size_mm: [x1 - x0, y1 - y0],
        notes: read.notes.into_iter().chain(read.warnings).collect(),
    })
}

/// One of them, checked.
pub fn load(place: &Place, name: &str) -> Result<Recipe> {
    let all = recipes(place)?;
    let found = all.iter().find(|r| r.name == name).ok_or_else(|| {
        Fault::input(format!("{name:?}: is no recipe of this station")).next("choose one from the list")
    })?;
    Recipe::parse(&found.text).map_err(|e| e.at(name))
}
