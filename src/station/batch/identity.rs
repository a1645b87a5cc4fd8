//! In: what a batch is made with. Out: its hashes: of the station, the recipe and the settings, and the name of the
//! folder that a recording's results get.
//! Frame and unit: none.

use crate::fault::{Fault, Result};
use crate::find::LocateOptions;
use crate::rig::{Rig, hash_file, hash_text};
use crate::scan::Where;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// How recordings are scanned, and what is looked for in them.
#[derive(Clone, Debug)]
pub struct BatchOptions {
    /// Folder of the station.
    pub station: PathBuf,
    /// Recipe (TOML) of what is looked for in each; `None`: nothing.
    pub recipe: Option<PathBuf>,
    /// Folder for the results and the tables.
    pub out: PathBuf,
    /// Settings other than the station's: names of `[extraction]` with dots.
    pub settings: BTreeMap<String, Value>,
    /// Where the stages run.
    pub place: Where,
    /// Exclude shots that cannot be read. Without it they refuse their recording.
    pub skip_bad: bool,
    /// How and where parts are looked for, and the notation of poses.
    pub locate: LocateOptions,
    /// Ends it; what was done is kept.
    pub stop: Arc<AtomicBool>,
}

/// What all results of a batch have in common; batch.json holds it.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Identity {
    /// Version of the results' format: 1.
    pub format: u32,
    /// Name and version of the program.
    pub program: String,
    /// SHA-256 of the manifest's lines.
    pub manifest: String,
    /// Recordings in it.
    pub recordings: u64,
    /// SHA-256 of station.toml and the calibrations.
    pub station: String,
    /// SHA-256 of the recipe; none: nothing is looked for.
    pub recipe: Option<String>,
    /// Settings other than the station's, where the stages run, and the notation of poses.
    pub settings: BTreeMap<String, Value>,
}

/// Version of result.json and batch.json.
pub(super) const FORMAT: u32 = 1;

impl Identity {
    /// Of these options, and of a manifest.
    pub fn of(options: &BatchOptions, manifest: &str, recordings: u64) -> Result<Identity> {
        let mut settings = options.settings.clone();
        let place: &str = match options.place {
            Where::Auto => "auto",
            Where::Gpu => "gpu",
            Where::Cpu => "cpu",
        };
        settings.insert("--on".into(), place.into());
        // Only where it is asked for: results of batches without it keep their names.
        if options.skip_bad {
            settings.insert("--skip-bad".into(), true.into());
        }
        settings.insert("--robot".into(), serde_json::to_value(options.locate.robot).expect("a word"));
        Ok(Identity {
            format: FORMAT,
            program: format!("sheetlight {}", env!("CARGO_PKG_VERSION")),
            manifest: manifest.into(),
            recordings,
            station: station(&options.station)?,
            recipe: options.recipe.as_deref().map(hash_file).transpose()?,
            settings,
        })
    }

    /// The name of the results of a recording with this hash.
    pub fn key(&self, input: &str) -> String {
        let (recipe, settings) = (self.recipe.as_deref().unwrap_or("-"), serde_json::to_string(&self.settings));
        hash_text(
            format!(
                "{} {}\ninput {input}\nstation {}\nrecipe {recipe}\nsettings {}\n",
                self.program,
                self.format,
                self.station,
                settings.expect("plain data")
            )
            .as_bytes(),
        )
    }

    /// What of another batch differs first, in words; `None`: nothing.
    pub fn differs(&self, other: &Identity) -> Option<String> {
        let short = |h: &str| h.chars().take(12).collect::<String>();
        let recipe = |i: &Identity| i.recipe.as_deref().map_or("none".into(), short);
        let settings = |i: &Identity| serde_json::to_string(&i.settings).expect("plain data");
        let pairs = [
            ("manifest", short(&self.manifest), short(&other.manifest)),
            ("station", short(&self.station), short(&other.station)),
            ("recipe", recipe(self), recipe(other)),
            ("settings", settings(self), settings(other)),
            ("program", self.program.clone(), other.program.clone()),
            ("format", self.format.to_string(), other.format.to_string()),
        ];
        let (what, mine, theirs) = pairs.into_iter().find(|(_, a, b)| a != b)?;
        Some(format!("its {what} is {theirs}, the one given now is {mine}"))
    }
}

/// Of station.toml and the records that a scan reads.
fn station(folder: &Path) -> Result<String> {
    // Ends what a stopped calibration has begun.
    Rig::load(folder)?;
    let calibration = folder.join("calibration");
    let entries = std::fs::read_dir(&calibration).map_err(|e| Fault::read(&calibration, e))?;
    let names = entries.flatten().map(|e| e.file_name().to_string_lossy().into_owned());
    let mut names: Vec<String> =
        names.filter(|n| n.ends_with(".json") && !n.contains(".previous.") && !n.starts_with('.')).collect();
    names.sort();
    let mut lines = String::new();
    for path in std::iter::once("station.toml".to_owned()).chain(names.iter().map(|n| format!("calibration/{n}"))) {
        if folder.join(&path).exists() {
            lines += &format!("{}  {path}\n", hash_file(&folder.join(&path))?);
        }
    }
    Ok(hash_text(lines.as_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn identity() -> Identity {
        Identity {
            format: FORMAT,
            program: "sheetlight 0.1.0".into(),
            manifest: "m".into(),
            recordings: 1,
            station: "s".into(),
            recipe: None,
            settings: [("threshold.minimum".to_owned(), Value::from(14))].into(),
        }
    }

    #[test]
    fn a_key_changes_with_all_that_results_are_made_from() {
        let first = identity();
        let key = first.key("a");
        assert_eq!(key, identity().key("a"));
        assert_eq!(
            key,
            Identity { manifest: "n".into(), recordings: 2, ..identity() }.key("a"),
            "one of several lists"
        );
        let settings = [("threshold.minimum".to_owned(), Value::from(15))].into();
        let others = [
            first.key("b"),
            Identity { station: "t".into(), ..identity() }.key("a"),
            Identity { recipe: Some("r".into()), ..identity() }.key("a"),
            Identity { settings, ..identity() }.key("a"),
            Identity { program: "sheetlight 0.2.0".into(), ..identity() }.key("a"),
        ];
        assert!(others.iter().all(|k| *k != key), "{others:?}");
        let other = Identity { station: "t".into(), ..identity() };
        assert_eq!(first.differs(&other).unwrap(), "its station is t, the one given now is s");
        assert_eq!(first.differs(&identity()), None);
    }
}
