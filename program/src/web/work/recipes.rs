//! Lists, reads, stores and removes recipes: those that ship with the program and those of the station. Lengths are
//! in mm, angles in degrees, in the part frame.

use super::place::Place;
use crate::web::guard::plain;
use crate::web::message::{
    DrawingAsk, DrawingRead, PointChange, PointsChange, PointsChanged, Problem, RecipePoint, RecipeText,
};
use sheetlight::fault::{Fault, Result};
use sheetlight::files::Lock;
use sheetlight::find::dxf::{self, DxfOptions, Unit};
use sheetlight::find::insert::recipe::InsertionSpec;
use sheetlight::find::measure::construct::nominal;
use sheetlight::find::{Recipe, TaskOptions, recipe_of};
use sheetlight::station::{back_up_here, point_added, point_chosen, point_taken_out};
use std::path::{Path, PathBuf};

const SHIPPED: [(&str, &str); 4] = [
    ("dimm", include_str!("../../../../data/recipes/dimm.toml")),
    ("flash", include_str!("../../../../data/recipes/flash.toml")),
    ("led", include_str!("../../../../data/recipes/led.toml")),
    ("osc", include_str!("../../../../data/recipes/osc.toml")),
];

/// All recipes: first the station's, sorted by name, then the shipped ones. A station's recipe replaces a shipped
/// one of the same name. A recipe that cannot be read is listed with the reason.
pub fn recipes(place: &Place) -> Vec<RecipeText> {
    let entries = std::fs::read_dir(place.recipes()).into_iter().flatten().flatten();
    let mut own: Vec<RecipeText> = entries.filter_map(|entry| of_file(&entry.path())).collect();
    own.sort_by(|a, b| a.name.cmp(&b.name));
    let shipped = SHIPPED.iter().filter(|(name, _)| !own.iter().any(|r| r.name == *name));
    let shipped: Vec<RecipeText> = shipped.map(|(name, text)| listed(name, Ok((*text).into()), true)).collect();
    own.into_iter().chain(shipped).collect()
}

fn of_file(path: &Path) -> Option<RecipeText> {
    let name = path.file_stem()?.to_string_lossy().into_owned();
    let is_one = path.extension().is_some_and(|e| e == "toml") && plain(&name);
    is_one.then(|| listed(&name, sheetlight::files::read_text(path), false))
}

/// A recipe's entry in the list.
fn listed(name: &str, text: Result<String>, shipped: bool) -> RecipeText {
    let read = text.as_ref().map_err(Clone::clone).and_then(|text| Recipe::parse(text));
    let title = read.as_ref().map(|r| if r.title.is_empty() { &r.name } else { &r.title }).cloned();
    RecipeText {
        name: name.into(),
        title: title.unwrap_or_default(),
        shipped,
        problem: read.err().as_ref().map(Problem::from),
        text: text.unwrap_or_default(),
    }
}

/// Path of a station's recipe. Returns an error for an invalid name.
fn recipe_path(place: &Place, name: &str) -> Result<PathBuf> {
    if !plain(name) {
        return Err(Fault::usage(format!("{name:?} is an invalid recipe name"))
            .cause("names have letters, digits, blanks and . _ - + ( )")
            .next("choose another name"));
    }
    Ok(place.recipes().join(format!("{name}.toml")))
}

/// Returns an error if the station has a recipe of this name, unless it is to be replaced. A shipped recipe of the
/// same name stays, and is visible again when the station's recipe is removed.
pub fn vacant(place: &Place, name: &str, replace: bool) -> Result<()> {
    if !replace && recipe_path(place, name)?.exists() {
        return Err(Fault::refused(format!("{name}: is a recipe of this station already"))
            .cause("another part was called so, or this one was stored before")
            .next("choose another name, or confirm the replacement"));
    }
    Ok(())
}

/// Checks and stores a recipe; one that it replaces goes into a backup of the station.
pub fn save_recipe(place: &Place, name: &str, text: &str, replace: bool) -> Result<RecipeText> {
    let path = recipe_path(place, name)?;
    Recipe::parse(text)?;
    sheetlight::files::make_folder(&place.recipes())?;
    // Jobs may store recipes at the same time.
    let _lock = Lock::wait(&place.recipes(), "recipes")?;
    if !sheetlight::files::read_text(&path).is_ok_and(|former| former == text) {
        vacant(place, name, replace)?;
        if path.exists() {
            back_up_here(&place.station, "before-recipe")?;
        }
        sheetlight::files::write(&path, text.as_bytes())?;
    }
    Ok(listed(name, Ok(text.into()), false))
}

/// Removes a recipe of the station; a backup of the station keeps it.
pub fn remove_recipe(place: &Place, name: &str) -> Result<()> {
    let path = recipe_path(place, name)?;
    if !path.is_file() {
        return Err(Fault::input(format!("{name}: is not a recipe of this station's own"))
            .cause("shipped recipes stay")
            .next("choose another"));
    }
    let _lock = Lock::wait(&place.recipes(), "recipes")?;
    back_up_here(&place.station, "before-recipe")?;
    sheetlight::files::remove(&path).map_err(|e| Fault::write(&path, e))
}

/// Adds, removes or selects a constructed point in a recipe's text.
///
/// # Errors
/// The text is not a recipe, or the change is not possible.
pub fn change_points(ask: &PointsChange) -> Result<PointsChanged> {
    let text = match &ask.change {
        PointChange::Add(point) => {
            let by_mm = point.by_mm.map(|by| serde_json::json!(by));
            let mut fields = serde_json::json!({ "name": point.name, "kind": point.kind, "of": point.of });
            by_mm.into_iter().for_each(|by| fields["by_mm"] = by);
            point.along.iter().for_each(|along| fields["along"] = serde_json::json!(along));
            let point = serde_json::from_value(fields)
                .map_err(|e| Fault::usage(format!("cannot be constructed: {e}")).next("choose one of the kinds"))?;
            point_added(&ask.text, &point)?
        }
        PointChange::TakeOut { name } => point_taken_out(&ask.text, name)?,
        PointChange::Choose { name } => point_chosen(&ask.text, name.as_deref())?,
    };
    Ok(PointsChanged { points: points(&text)?, text })
}

/// All points that the tool can be sent to in a recipe's text: named shapes, and points constructed from them.
///
/// # Errors
/// The text is not a recipe.
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
            // A lattice is constructed from the whole grid.
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

/// Makes a recipe from a drawing and stores it.
pub fn from_drawing(place: &Place, ask: &DrawingAsk) -> Result<DrawingRead> {
    vacant(place, &ask.name, ask.replace)?;
    let unit = ask.unit.as_deref().map(str::parse::<Unit>).transpose();
    let unit = unit.map_err(|e| Fault::usage(e).next("choose one of the units"))?;
    let options = DxfOptions { unit, layers: ask.layers.clone(), origin: ask.origin };
    let read = dxf::read(ask.text.as_bytes(), &options)?;
    let [x0, y0, x1, y1] = read.drawing.bounds();
    let insertion = InsertionSpec::at_the_part((ask.tolerance_mm, ask.tolerance_deg), ask.approach_mm, ask.approach_mm);
    let (name, cell_mm, alike_turns) = (ask.name.clone(), ask.cell_mm, ask.alike_turns);
    let made = recipe_of(read.drawing, &TaskOptions { name, cell_mm, alike_turns, insertion })?;
    let text = toml::to_string(&made).expect("plain data");
    let recipe = save_recipe(place, &ask.name, &text, ask.replace)?;
    Ok(DrawingRead {
        recipe,
        size_mm: [x1 - x0, y1 - y0],
        notes: read.notes.into_iter().chain(read.warnings).collect(),
    })
}

/// Loads and checks a recipe, without reading any other.
pub fn load(place: &Place, name: &str) -> Result<Recipe> {
    let path = recipe_path(place, name)?;
    if path.exists() {
        return Recipe::load(&path);
    }
    let shipped = SHIPPED.iter().find(|(known, _)| *known == name).ok_or_else(|| {
        Fault::input(format!("{name:?}: is not a recipe of this station")).next("choose one from the list")
    })?;
    Recipe::parse(shipped.1).map_err(|e| e.at(name))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::web::message::Mode;
    use sheetlight::station::{Backup, backups};

    const LED: &str = SHIPPED[2].1;

    fn place() -> (tempfile::TempDir, Place) {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("station.toml"), "name = 'a'\n").unwrap();
        let place = Place { station: dir.path().into(), recordings: dir.path().into(), mode: Mode::Replay };
        std::fs::create_dir(place.recipes()).unwrap();
        (dir, place)
    }

    /// Texts of a recipe in the station's backups, in the order of the backups.
    fn backed_up(place: &Place, name: &str) -> Vec<Option<String>> {
        let mut all: Vec<Backup> = std::fs::read_dir(backups(&place.station))
            .into_iter()
            .flatten()
            .map(|e| Backup::load(&e.unwrap().path()).unwrap())
            .collect();
        all.sort_by(|a, b| a.created.cmp(&b.created));
        all.into_iter().map(|b| b.files.get(&format!("recipes/{name}.toml")).cloned()).collect()
    }

    fn stored(place: &Place, name: &str) -> String {
        std::fs::read_to_string(place.recipes().join(format!("{name}.toml"))).unwrap()
    }

    #[test]
    fn a_recipe_is_replaced_only_where_that_is_said_and_lies_in_a_backup_then() {
        let (_dir, place) = place();
        let other = LED.replace("alike_turns = 2", "alike_turns = 1");
        save_recipe(&place, "mine", LED, false).unwrap();
        assert_eq!(save_recipe(&place, "mine", &other, false).unwrap_err().kind, sheetlight::fault::Kind::Refused);
        assert_eq!((stored(&place, "mine"), backed_up(&place, "mine").len()), (LED.into(), 0));
        // Storing the same text again replaces nothing.
        save_recipe(&place, "mine", LED, false).unwrap();
        assert!(save_recipe(&place, "mine", "format = 1", true).is_err() && stored(&place, "mine") == LED);
        let saved = save_recipe(&place, "mine", &other, true).unwrap();
        assert!(saved.text == other && saved.problem.is_none() && !saved.shipped);
        assert_eq!((stored(&place, "mine"), backed_up(&place, "mine")), (other.clone(), vec![Some(LED.into())]));
        remove_recipe(&place, "mine").unwrap();
        assert_eq!(backed_up(&place, "mine"), [Some(LED.into()), Some(other)]);
        assert!(remove_recipe(&place, "mine").is_err() && load(&place, "mine").is_err());
        // A shipped recipe is hidden while the station has one of its name.
        save_recipe(&place, "led", LED, false).unwrap();
        assert!(!recipes(&place).iter().any(|r| r.name == "led" && r.shipped));
        remove_recipe(&place, "led").unwrap();
        assert!(recipes(&place).iter().any(|r| r.name == "led" && r.shipped));
    }

    #[test]
    fn a_drawing_replaces_no_recipe_without_a_word() {
        let (_dir, place) = place();
        save_recipe(&place, "socket", LED, false).unwrap();
        let box_ = [(-15.0, -9.0), (15.0, -9.0), (15.0, 9.0), (-15.0, 9.0)];
        let corners: String = box_.iter().map(|(x, y)| format!("10\n{x}\n20\n{y}\n")).collect();
        let text = format!(
            "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n\
             0\nLWPOLYLINE\n8\n0\n90\n4\n70\n1\n\
             {corners}0\nCIRCLE\n8\n0\n10\n3\n20\n2\n40\n1\n0\nENDSEC\n0\nEOF\n"
        );
        let ask = |replace| DrawingAsk {
            name: "socket".into(),
            text: text.clone(),
            unit: None,
            layers: vec![],
            origin: None,
            alike_turns: 1,
            cell_mm: 0.5,
            tolerance_mm: 0.2,
            tolerance_deg: 1.0,
            approach_mm: 20.0,
            replace,
        };
        assert!(from_drawing(&place, &ask(false)).unwrap_err().what.contains("socket"));
        assert_eq!(stored(&place, "socket"), LED);
        let read = from_drawing(&place, &ask(true)).unwrap();
        assert_eq!((stored(&place, "socket"), backed_up(&place, "socket")), (read.recipe.text, vec![Some(LED.into())]));
    }

    #[test]
    fn one_unreadable_recipe_hides_no_other() {
        let (_dir, place) = place();
        save_recipe(&place, "mine", LED, false).unwrap();
        std::fs::write(place.recipes().join("bytes.toml"), [0xff, 0xfe, b'x', 0]).unwrap();
        std::fs::write(place.recipes().join("torn.toml"), "format = 1\nname = ").unwrap();
        let all = recipes(&place);
        let own: Vec<_> = all.iter().filter(|r| !r.shipped).map(|r| (&*r.name, r.problem.is_some())).collect();
        assert_eq!(own, [("bytes", true), ("mine", false), ("torn", true)]);
        assert_eq!(all.len(), 3 + SHIPPED.len());
        assert!(all.iter().find(|r| r.name == "torn").unwrap().text.starts_with("format"), "it can be mended");
        load(&place, "mine").unwrap();
        load(&place, "led").unwrap();
        assert!(load(&place, "bytes").unwrap_err().next.contains("UTF-8") && load(&place, "torn").is_err());
        // It is backed up with the others, byte by byte, and can be restored.
        remove_recipe(&place, "bytes").unwrap();
        let made = std::fs::read_dir(backups(&place.station)).unwrap().next().unwrap().unwrap().path();
        Backup::load(&made).unwrap().restore(&place.station).unwrap();
        assert_eq!(std::fs::read(place.recipes().join("bytes.toml")).unwrap(), [0xff, 0xfe, b'x', 0]);
    }
}
