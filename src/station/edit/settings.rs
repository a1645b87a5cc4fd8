//! Changes settings in the text of a station.toml by their dotted names; comments, order and blank lines stay.

use super::document::Document;
use crate::fault::{Fault, Result};
use crate::station::settings::Settings;
use serde_json::Value;
use std::collections::BTreeMap;

/// Changes settings; `null` removes one.
///
/// # Errors
/// Names that are not settings, or values that a station cannot have; then the whole change is refused.
pub fn edited(text: &str, changes: &BTreeMap<String, Value>) -> Result<String> {
    let meant = meant(text, changes)?;
    let mut made = text.to_owned();
    for (key, value) in changes {
        let mut doc = Document::parse(&made)?;
        doc.put(&key.split('.').collect::<Vec<_>>(), Some(value).filter(|v| !v.is_null()))?;
        made = doc.text();
    }
    Settings::parse(&made)?;
    if pruned(toml::from_str(&made).unwrap_or_default()) == meant {
        return Ok(made);
    }
    Err(Fault::input("station.toml has an unusual layout, so that this setting alone cannot be changed")
        .cause("a table is written in an unusual way")
        .next("change the text itself"))
}

/// The content that the changed text must have, whatever its layout.
fn meant(text: &str, changes: &BTreeMap<String, Value>) -> Result<toml::Table> {
    Settings::parse(text)?;
    let mut all: toml::Table = toml::from_str(text).unwrap_or_default();
    for (key, value) in changes {
        let refuse = |what: String| Fault::usage(format!("{key}: {what}")).next("compare it with docs/file-formats.md");
        let (tables, name) = key.rsplit_once('.').unwrap_or(("", key));
        let mut at = &mut all;
        for word in tables.split('.').filter(|w| !w.is_empty()) {
            let below = at.entry(word).or_insert_with(|| toml::Value::Table(toml::Table::new()));
            at = below.as_table_mut().ok_or_else(|| refuse(format!("{word} is not a table of settings")))?;
        }
        match Some(value).filter(|v| !v.is_null()).map(toml::Value::try_from).transpose() {
            Ok(Some(value)) => drop(at.insert(name.to_owned(), value)),
            Ok(None) => drop(at.remove(name)),
            Err(e) => return Err(refuse(e.to_string())),
        }
    }
    Ok(pruned(all))
}

/// Removes tables without any setting.
fn pruned(table: toml::Table) -> toml::Table {
    let below = |value| match value {
        toml::Value::Table(t) => Some(pruned(t)).filter(|t| !t.is_empty()).map(toml::Value::Table),
        value => Some(value),
    };
    table.into_iter().filter_map(|(name, value)| Some((name, below(value)?))).collect()
}

/// The settings themselves, changed and checked. Names are dotted and relative to the table `below` ("" or
/// "extraction").
///
/// # Errors
/// Names that are not settings, or values that a station cannot have.
pub fn changed(settings: &Settings, below: &str, changes: &BTreeMap<String, Value>) -> Result<Settings> {
    let mut all = serde_json::to_value(settings).expect("plain data");
    for (key, value) in changes {
        let key = if below.is_empty() { key.clone() } else { format!("{below}.{key}") };
        let (table, name) = key.rsplit_once('.').unwrap_or(("", &key));
        let mut at = &mut all;
        for word in table.split('.').filter(|w| !w.is_empty()) {
            at = at.as_object_mut().expect("a table").entry(word).or_insert_with(|| Value::Object(Default::default()));
            if !at.is_object() {
                return Err(Fault::usage(format!("{key}: {word} is not a table of settings")).next("correct the name"));
            }
        }
        let at = at.as_object_mut().expect("a table");
        if value.is_null() {
            at.remove(name)
        } else {
            at.insert(name.to_owned(), value.clone())
        };
    }
    // A table without any setting left is removed.
    let all: serde_json::Map<String, Value> = match all {
        Value::Object(map) => map.into_iter().filter(|(_, v)| v.as_object().is_none_or(|o| !o.is_empty())).collect(),
        _ => Default::default(),
    };
    let changed: Settings = serde_json::from_value(Value::Object(all)).map_err(|e| {
        Fault::input(format!("the settings cannot be changed so: {e}"))
            .cause("unknown key, wrong type, or missing key")
            .next("compare it with docs/file-formats.md")
    })?;
    changed.check()?;
    Ok(changed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::Convention;
    use serde_json::json;

    const TEXT: &str = "# cell 3, by the window\nname = \"cell # 3\" # as on its door\nrobot = \"denso\"\n\n\
        [working_volume] # measured in May\nnear_mm = 60\nfar_mm = 320\n";

    fn changed(text: &str, key: &str, value: Value) -> Result<String> {
        edited(text, &BTreeMap::from([(key.to_owned(), value)]))
    }

    #[test]
    fn a_setting_changes_and_nothing_else() {
        assert_eq!(changed(TEXT, "robot", json!("ur")).unwrap(), TEXT.replace("\"denso\"", "\"ur\""));
        assert_eq!(changed(TEXT, "working_volume.far_mm", json!(400.5)).unwrap(), TEXT.replace("320", "400.5"));
        let named = changed(TEXT, "name", json!("cell 4")).unwrap();
        assert_eq!(named, TEXT.replace("\"cell # 3\"", "\"cell 4\""), "the comment stays");
        let more = changed(TEXT, "tolerance_mm", json!(0.05)).unwrap();
        assert!(more.contains("robot = \"denso\"\ntolerance_mm = 0.05\n\n[working_volume]"), "{more}");
        assert_eq!(changed(&more, "tolerance_mm", Value::Null).unwrap(), TEXT);
        let deeper = changed(TEXT, "extraction.threshold.minimum", json!(14)).unwrap();
        assert!(
            deeper.starts_with(TEXT) && Settings::parse(&deeper).unwrap().extraction.threshold.minimum == 14,
            "{deeper}"
        );
    }

    /// One layout with tables, one with dotted names, one with braces; lists and braces over several lines.
    const LAYOUTS: [&str; 3] = [
        "name = \"cell # 3\"\nrobot = \"denso\"\nmount = 'eye-in-hand'\ntolerance_mm = 0.1\n\n\
         [working_volume]\nnear_mm = 60\nfar_mm = 320\n\n\
         [motion]\nspeed_mm_s = 40\nmax_step_mm = 300\n\
         [motion.workspace]\nfrom_mm = [\n150,\n-350,\n200,\n]\nto_mm = [650, 350, 750]\n\
         [[motion.keep_out]]\nfrom_mm = [1, 2, 3]\nto_mm = [4, 5, 6]\n\n\
         [outputs]\nline = 24\ngripper = 27\n\
         [extraction]\nregion = [\n0.1,\n0.2,\n0.9,\n1\n]\n\
         [extraction.threshold]\nminimum = 14\n",
        "working_volume.near_mm = 60\nname = 'a'\nworking_volume.far_mm = 320\n\
         extraction.threshold.minimum = 14\nextraction.region = [0.1,\n0.2, 0.9,\n1]\noutputs.line = 24\n\
         motion.workspace.from_mm = [150, -350, 200]\nmotion.workspace.to_mm = [650, 350, 750]\n\
         motion.speed_mm_s = 40\n",
        "working_volume = {\nnear_mm = 60,\nfar_mm = 320\n}\nrobot = 'ur'\n\
         extraction = { region = [0.1, 0.2, 0.9, 1] }\noutputs = { line = 24,\ngripper = 27 }\n\
         motion = { speed_mm_s = 40, workspace = { from_mm = [150, -350, 200], to_mm = [650, 350, 750] } }\n",
    ];

    /// Settings that the pages change, with two values each.
    fn changes() -> Vec<(&'static str, [Value; 2])> {
        let numbers = ["working_volume.near_mm", "working_volume.far_mm", "motion.speed_mm_s", "motion.max_step_mm"]
            .into_iter()
            .chain(["motion.max_turn_deg", "motion.max_turn_deg_s", "motion.max_tilt_deg"]);
        let outputs = ["outputs.line", "outputs.pointer", "outputs.room", "outputs.gripper"];
        let mut all: Vec<_> = numbers.map(|n| (n, [json!(55), json!(20.5)])).collect();
        all.push(("motion.max_still_ms", [json!(250), json!(1200.5)]));
        all.extend(outputs.map(|n| (n, [json!(3), json!(60)])));
        all.push(("name", [json!("cell \"4\" # b"), json!("")]));
        all.push(("robot", [json!("kuka"), json!("ur")]));
        all.push(("mount", [json!("eye-to-hand"), json!("eye-in-hand")]));
        all.push(("tolerance_mm", [json!(0.05), json!(1)]));
        all.push(("extraction.region", [json!([0, 0, 1, 1]), json!([0.25, 0.2, 0.9, 0.5])]));
        all.push(("extraction.threshold.minimum", [json!(9), json!(20)]));
        all.push((
            "tool",
            [json!({"flange_from_tool": [1, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1, 120, 0, 0, 0, 1]}), Value::Null],
        ));
        all.push(("motion.keep_out", [json!([{"from_mm": [0, 0, 0], "to_mm": [9, 9, 9]}]), json!([])]));
        all
    }

    /// The text with a comment above and beside every line.
    fn commented(text: &str) -> String {
        text.lines().enumerate().map(|(i, l)| format!("# above {i}.\n  {l} # beside {i}.\n")).collect::<String>()
            + "# end."
    }

    /// Collects every value of a text by its dotted name.
    fn values(table: &toml::Table, before: &str, out: &mut BTreeMap<String, toml::Value>) {
        for (name, value) in table {
            match value {
                toml::Value::Table(t) => values(t, &format!("{before}{name}."), out),
                value => drop(out.insert(format!("{before}{name}"), value.clone())),
            }
        }
    }

    fn read(text: &str) -> BTreeMap<String, toml::Value> {
        let mut out = BTreeMap::new();
        values(&toml::from_str(text).unwrap(), "", &mut out);
        out
    }

    /// The changed text, after checking every comment and value in it; `None` if a station cannot have that value.
    fn judged(first: &str, text: &str, key: &str, value: &Value) -> Option<String> {
        let mut wanted = read(text);
        wanted.retain(|name, _| name != key && !name.starts_with(&format!("{key}.")));
        match value {
            Value::Null => {}
            Value::Object(_) => values(&toml::Table::try_from(value).unwrap(), &format!("{key}."), &mut wanted),
            value => drop(wanted.insert(key.to_owned(), toml::Value::try_from(value).unwrap())),
        }
        let plain: String = wanted.iter().map(|(name, value)| format!("{name} = {value}\n")).collect();
        let made = edited(text, &BTreeMap::from([(key.to_owned(), value.clone())]));
        if Settings::parse(&plain).is_err() {
            assert!(made.is_err(), "{key} = {value}");
            return None;
        }
        let made = made.unwrap_or_else(|e| panic!("{key} = {value}: {e}\n{text}"));
        assert_eq!(read(&made), wanted, "{key} = {value}\n{made}");
        for comment in crate::station::edit::document::comments(first) {
            let times = made.matches(comment).count();
            assert_eq!(times, 1, "{key} = {value}: {comment:?} stands there {times} times\n{made}");
        }
        Some(made)
    }

    #[test]
    fn every_comment_survives_every_change_of_the_pages() {
        let mut tried = 0;
        for layout in LAYOUTS {
            let text = commented(layout);
            assert_eq!(text.matches('#').count() - layout.matches('#').count(), 2 * layout.lines().count() + 1);
            for (key, values) in changes() {
                for value in values.iter().chain([&Value::Null]) {
                    tried += usize::from(judged(&text, &text, key, value).is_some());
                }
            }
        }
        assert!(tried > 120, "{tried} changes");
    }

    #[test]
    fn comments_survive_many_changes_one_after_another() {
        use rand::{Rng, SeedableRng};
        let mut rng = rand_pcg::Pcg64::seed_from_u64(7);
        for round in 0..300 {
            let first = commented(LAYOUTS[round % LAYOUTS.len()]);
            let mut text = first.clone();
            for _ in 0..12 {
                let (key, values) = changes().swap_remove(rng.random_range(0..changes().len()));
                let value = if rng.random_bool(0.4) { Value::Null } else { values[rng.random_range(0..2)].clone() };
                text = judged(&first, &text, key, &value).unwrap_or(text);
            }
        }
    }

    #[test]
    fn a_table_goes_with_its_last_setting_and_nothing_else() {
        let both = BTreeMap::from(["near_mm", "far_mm"].map(|k| (format!("working_volume.{k}"), Value::Null)));
        let text = "robot = \"ur\"\n\n[working_volume]\nnear_mm = 60\nfar_mm = 320\n\n[outputs]\nline = 3\n";
        assert_eq!(edited(text, &both).unwrap(), "robot = \"ur\"\n\n[outputs]\nline = 3\n");
        assert_eq!(edited(TEXT, &both).unwrap(), TEXT[..TEXT.find("[w").unwrap()].to_owned() + "# measured in May\n");
    }

    #[test]
    fn inline_tables_stay_inline_and_mean_the_same() {
        let text = "working_volume = { near_mm = 60, far_mm = 320 }\nrobot = \"ur\"\n";
        let made = Settings::parse(&changed(text, "working_volume.near_mm", json!(80)).unwrap()).unwrap();
        assert_eq!((made.working_volume.unwrap().near_mm, made.robot), (80.0, Some(Convention::Ur)));
        let both = BTreeMap::from(["near_mm", "far_mm"].map(|k| (format!("working_volume.{k}"), Value::Null)));
        assert_eq!(edited(text, &both).unwrap(), "robot = \"ur\"\n");
    }

    #[test]
    fn what_a_station_cannot_have_is_refused() {
        for (key, value) in [
            ("robbot", json!("ur")),
            ("robot", json!("no such make")),
            ("robot.name", json!("ur")),
            ("working_volume.near_mm", json!(500)),
            ("tolerance_mm", json!(0)),
            ("motion.speed_mm_s", json!(40)),
        ] {
            assert!(changed(TEXT, key, value).is_err(), "{key}");
        }
    }
}
