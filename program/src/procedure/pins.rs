//! In: a recipe whose part was found, two positions selected on the height map. Out: the same recipe with the tool
//! at the middle of the two nearest named shapes.
//! Frame and unit: grid frame of the map, part frame; mm.

use sheetlight::fault::{Fault, Result};
use sheetlight::find::Recipe;
use sheetlight::find::measure::construct::{Build, Construction};
use sheetlight::geometry::{Grid, Part, Rigid, Vec3};

/// The recipe's name for the middle of the two shapes.
const BETWEEN: &str = "between two pins";
/// Largest distance between a selected position and the nearest shape, mm: a finger on the screen is not exact.
const FINGER: f64 = 1.5;

/// Puts the tool at the middle of the two shapes; a lattice in the recipe must still agree with it.
///
/// # Errors
/// A recipe without named shapes, a position away from all of them, the same shape twice.
pub fn between_pins(recipe: &Recipe, grid_from_part: &Rigid<Grid, Part>, places: &[[f64; 2]; 2]) -> Result<Recipe> {
    let [a, b] = [nearest(recipe, grid_from_part, &places[0])?, nearest(recipe, grid_from_part, &places[1])?];
    if a == b {
        return Err(Fault::usage(format!("both places are {a}")).next("point at another pin as the second one"));
    }
    let middle = Construction { name: BETWEEN.into(), kind: Build::Midpoint, of: vec![a, b], by_mm: None, along: None };
    let mut out = recipe.clone();
    out.construction.retain(|c| c.name != BETWEEN);
    out.construction.push(middle);
    (out.insertion.construction, out.insertion.two_pin) = (BETWEEN.into(), Some(BETWEEN.into()));
    out.check()?;
    Ok(out)
}

/// The named shape nearest to a position.
fn nearest(recipe: &Recipe, grid_from_part: &Rigid<Grid, Part>, place: &[f64; 2]) -> Result<String> {
    let drawing = recipe.drawing();
    let named = drawing.shape.iter().enumerate().filter_map(|(i, s)| Some((i, s, s.name.as_ref()?)));
    let all = named.flat_map(|(i, s, name)| (0..s.elements()).map(move |e| (i, e, s.grid.map(|g| g.count), name)));
    let away = |shape: usize, element: usize| {
        let [x, y] = drawing.centre_of(shape, element);
        let at = grid_from_part.point(&Vec3::new(x, y, drawing.shape[shape].z_mm));
        (at.x - place[0]).hypot(at.y - place[1])
    };
    let best = all.map(|(i, e, count, name)| (away(i, e), e as u32, count, name)).min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((mm, element, count, name)) = best else {
        return Err(Fault::refused(format!("the recipe {:?} names no pins", recipe.name))
            .cause("it was taught without them, or its shapes have no names")
            .next("give its holes or contacts a name in the recipe, as data/recipes/led.toml does"));
    };
    let word = match count {
        Some([columns, rows]) if columns * rows > 1 => {
            format!("{name}[{},{}]", element % columns + 1, element / columns + 1)
        }
        _ => name.clone(),
    };
    if mm.is_nan() || mm > FINGER {
        return Err(Fault::refused(format!("no pin lies within {FINGER} mm of {:.2} {:.2} mm", place[0], place[1]))
            .cause(format!("the nearest is {word}, {mm:.1} mm away"))
            .next("enlarge the map and point at the pin's middle"));
    }
    Ok(word)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sheetlight::find::Drawing;

    fn led() -> Recipe {
        Recipe::parse(include_str!("../../../data/recipes/led.toml")).unwrap()
    }

    /// The part, rotated by 30 degrees about its datum.
    fn lies() -> Rigid<Grid, Part> {
        Rigid::from_vectors(&Vec3::new(0.0, 0.0, 30f64.to_radians()), Vec3::new(40.0, 25.0, 3.0))
    }

    fn place(drawing: &Drawing, name: &str, off: [f64; 2]) -> [f64; 2] {
        let (_, _, [x, y]) = drawing.named(name).unwrap();
        let at = lies().point(&Vec3::new(x, y, 0.0));
        [at.x + off[0], at.y + off[1]]
    }

    #[test]
    fn the_tool_goes_between_the_pins_that_were_pointed_at() {
        let recipe = led();
        let drawing = recipe.drawing();
        let shape = drawing.shape.iter().find(|s| s.name.is_some() && s.grid.is_some()).unwrap();
        let (name, [columns, rows]) = (shape.name.as_deref().unwrap(), shape.grid.unwrap().count);
        let [a, b] = [format!("{name}[1,1]"), format!("{name}[{columns},{rows}]")];
        let places = [place(&drawing, &a, [0.4, -0.3]), place(&drawing, &b, [-0.2, 0.5])];
        let made = between_pins(&recipe, &lies(), &places).unwrap();
        let last = made.construction.last().unwrap();
        assert_eq!((last.of.clone(), made.insertion.construction.as_str()), (vec![a, b], BETWEEN));
        assert_eq!(made.insertion.lattice, recipe.insertion.lattice, "the lattice is still compared with");
        // With other pins, the tool goes to their middle instead.
        let again = between_pins(&made, &lies(), &[places[1], places[0]]).unwrap();
        assert_eq!(again.construction.len(), made.construction.len());
        assert!(between_pins(&recipe, &lies(), &[places[0]; 2]).unwrap_err().what.contains("both places are"));
        let beside = [places[0][0] + 40.0, places[0][1]];
        let e = between_pins(&recipe, &lies(), &[places[0], beside]).unwrap_err();
        assert!(e.what.contains("no pin lies within"), "{}", e.what);
        let mut bare = recipe;
        bare.shape.iter_mut().for_each(|s| s.name = None);
        assert!(between_pins(&bare, &lies(), &places).unwrap_err().what.contains("names no pins"));
    }
}
