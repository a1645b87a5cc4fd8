//! Adds a constructed point to a recipe's text, removes one, or sets the target of the insertion.

use super::document::Document;
use crate::fault::{Fault, Result};
use crate::find::Recipe;
use crate::find::measure::construct::Construction;
use serde_json::json;
use toml_edit::{ArrayOfTables, Item, Table};

/// Key of the constructed points.
const LIST: &str = "construction";

/// The text with one more point, after the points that it may be built from.
///
/// # Errors
/// The text is not a recipe; the point cannot be built, or its name is already used.
pub fn point_added(text: &str, point: &Construction) -> Result<String> {
    let mut wanted = Recipe::parse(text)?;
    wanted.construction.push(point.clone());
    wanted.check()?;
    let value = serde_json::to_value(point).expect("plain data");
    let fields = value.as_object().expect("a point has names");
    let mut doc = Document::parse(text)?;
    if doc.root.get(LIST).and_then(Item::as_array).is_some_and(|list| list.is_empty()) {
        doc.put(&[LIST], None)?;
        return point_added(&doc.text(), point);
    }
    if doc.root.get(LIST).is_some_and(Item::is_value) {
        let mut all = serde_json::to_value(&wanted.construction).expect("plain data");
        all.as_array_mut().into_iter().flatten().for_each(drop_nulls);
        doc.put(&[LIST], Some(&all))?;
        return checked(doc.text(), &wanted);
    }
    let mut entry = Table::new();
    for (name, value) in fields.iter().filter(|(_, v)| !v.is_null()) {
        entry.insert(name, Item::Value(super::document::plain(value)?));
    }
    // The first point is placed before the insertion, which may use it.
    let insertion = doc.root.get("insertion").and_then(Item::as_table).and_then(Table::position);
    let list = doc.root.entry(LIST).or_insert(Item::ArrayOfTables(ArrayOfTables::new()));
    let list = list.as_array_of_tables_mut().ok_or_else(strange)?;
    if list.is_empty() {
        entry.set_position(insertion.map(|p| p - 1));
    }
    list.push(entry);
    checked(doc.text(), &wanted)
}

fn drop_nulls(value: &mut serde_json::Value) {
    value.as_object_mut().into_iter().for_each(|o| o.retain(|_, v| !v.is_null()));
}

/// The text without the point of that name.
///
/// # Errors
/// The text is not a recipe, or another part of it uses that point.
pub fn point_taken_out(text: &str, name: &str) -> Result<String> {
    let mut wanted = Recipe::parse(text)?;
    let index = wanted.construction.iter().position(|c| c.name == name).ok_or_else(|| {
        Fault::input(format!("{name}: is not a constructed point of this recipe")).next("choose one of the list")
    })?;
    wanted.construction.remove(index);
    wanted.check()?;
    let mut doc = Document::parse(text)?;
    doc.take_out_of(LIST, index)?;
    checked(doc.text(), &wanted)
}

/// The text with that point as the insertion's target; `None`: the part's own pose.
///
/// # Errors
/// The text is not a recipe, or has no such point.
pub fn point_chosen(text: &str, name: Option<&str>) -> Result<String> {
    let mut wanted = Recipe::parse(text)?;
    wanted.insertion.construction = name.unwrap_or("pose").to_owned();
    wanted.check()?;
    let mut doc = Document::parse(text)?;
    doc.put(&["insertion", LIST], name.map(|n| json!(n)).as_ref())?;
    checked(doc.text(), &wanted)
}

/// Returns the text if it parses to the wanted recipe.
fn checked(text: String, wanted: &Recipe) -> Result<String> {
    if Recipe::parse(&text).is_ok_and(|r| r == *wanted) { Ok(text) } else { Err(strange()) }
}

fn strange() -> Fault {
    Fault::input("the recipe's text has an unusual layout, so that a single point cannot be changed")
        .cause("its constructed points are no list of tables")
        .next("change them in the text")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::find::measure::construct::Build;
    use crate::station::edit::document::comments;

    /// A recipe as shipped, with a comment above and beside every line.
    fn commented() -> String {
        let text = include_str!("../../../data/recipes/led.toml");
        let beside = |l: &str| if l.trim().is_empty() || l.contains('#') { String::new() } else { " # beside".into() };
        let line = |(i, l): (usize, &str)| {
            format!("# above {i}.\n{l}{}\n", beside(l).replace("beside", &format!("beside {i}.")))
        };
        text.lines().enumerate().map(line).collect()
    }

    fn point(name: &str, kind: Build, of: &[&str]) -> Construction {
        let of = of.iter().map(|n| (*n).to_owned()).collect();
        Construction { name: name.into(), kind, of, by_mm: None, along: None }
    }

    fn keeps_comments(before: &str, after: &str) {
        for comment in comments(before) {
            assert!(after.matches(comment).count() == 1, "{comment:?} is lost or doubled\n{after}");
        }
    }

    #[test]
    fn every_comment_survives_what_the_page_does_with_points() {
        let text = commented();
        let named = |text: &str| Recipe::parse(text).unwrap().construction;
        let offset = Construction {
            by_mm: Some([2.54, -1.0]),
            along: Some("all pins".into()),
            ..point("aside", Build::Offset, &["two pins"])
        };
        let mut now = text.clone();
        for more in [
            point("corner \"a\" # 1", Build::Midpoint, &["pin[1,1]", "pin[12,2]"]),
            point("row", Build::Line, &["pin[1,1]", "pin[12,1]"]),
            point("net", Build::Lattice, &["pin"]),
            offset,
        ] {
            now = point_added(&now, &more).unwrap();
            keeps_comments(&text, &now);
            assert_eq!(named(&now).last(), Some(&more));
            for goal in [Some(&*more.name).filter(|_| more.kind != Build::Line), None, Some("two pins")] {
                let to = point_chosen(&now, goal).unwrap();
                keeps_comments(&text, &to);
                assert_eq!(Recipe::parse(&to).unwrap().insertion.construction, goal.unwrap_or("pose"));
                keeps_comments(&text, &point_chosen(&to, None).unwrap());
            }
        }
        // Removed from last to first, after the insertion's own names.
        now = now.replace("two_pin = \"two pins\"", "").replace("lattice = \"all pins\"", "");
        for c in named(&now).iter().rev() {
            let without = point_taken_out(&now, &c.name).unwrap();
            assert!(
                named(&without).iter().all(|other| other.name != c.name)
                    && named(&without).len() + 1 == named(&now).len()
            );
            keeps_comments(&now, &without);
            now = without;
        }
        assert!(named(&now).is_empty());
        let again = point_added(&now, &point("m", Build::Midpoint, &["pin[1,1]", "pin[2,1]"])).unwrap();
        keeps_comments(&now, &again);
        assert!(again.find("[[construction]]") < again.find("[insertion]"), "{again}");
    }

    #[test]
    fn points_change_in_texts_of_other_layouts_too() {
        let recipe =
            Recipe { construction: vec![], ..Recipe::parse(include_str!("../../../data/recipes/led.toml")).unwrap() };
        let mut bare = recipe.clone();
        (bare.insertion.two_pin, bare.insertion.lattice) = (None, None);
        let m = point("m", Build::Midpoint, &["pin[1,1]", "pin[2,1]"]);
        let written = point_added(&toml::to_string(&bare).unwrap(), &m).unwrap();
        assert_eq!(Recipe::parse(&written).unwrap().construction, std::slice::from_ref(&m));
        let text = "construction = [ # one\n{ name = 'a', kind = 'line', of = ['pin[1,1]', 'pin[2,1]'] }, # two\n]\n"
            .to_owned();
        let text = text + &toml::to_string(&bare).unwrap().replace("construction = []\n", "");
        let both = point_added(&text, &m).unwrap();
        keeps_comments(&text, &both);
        for name in ["m", "a"] {
            let left = point_taken_out(&both, name).unwrap();
            keeps_comments(&text, &left);
            assert_eq!(Recipe::parse(&left).unwrap().construction.len(), 1, "{left}");
        }
    }

    #[test]
    fn what_a_recipe_cannot_have_is_refused() {
        let text = include_str!("../../../data/recipes/led.toml");
        assert!(point_taken_out(text, "two pins").unwrap_err().what.contains("two pins"), "the insertion names it");
        assert!(point_taken_out(text, "none").is_err() && point_chosen(text, Some("none")).is_err());
        assert!(point_added(text, &point("two pins", Build::Midpoint, &["pin[1,1]", "pin[2,1]"])).is_err(), "taken");
        assert!(point_added("name = 1", &point("x", Build::Line, &[])).is_err());
    }
}
