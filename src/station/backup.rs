//! In: a station. Out: all its settings and measurements in one file, and their restoration; jobs and recordings
//! are not included.
//! Frame and unit: file contents as stored in the station.

use super::settings::Settings;
use crate::fault::{Fault, Result};
use crate::files::{Lock, Together, remove};
use crate::rig::{Rig, hash_text};
use base64::prelude::{BASE64_STANDARD, Engine};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Version of the file.
const FORMAT: u32 = 1;
/// The content of a station: its settings, and folders of texts.
const SETTINGS: &str = "station.toml";
const FOLDERS: [&str; 3] = ["calibration", "recipes", "boards"];
/// Most bytes of one file of a backup.
const MOST_BYTES: u64 = 64 << 20;
/// Most files of a backup.
const MOST_FILES: usize = 2000;

/// A station in one file.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Backup {
    /// 1.
    pub format: u32,
    /// Name and version of the program that made it.
    pub program: String,
    /// Time of the backup, UTC, RFC 3339.
    pub created: String,
    /// The station's name.
    pub station: String,
    /// SHA-256 over all names and file contents.
    pub seal: String,
    /// Texts by their path in the station.
    pub files: BTreeMap<String, String>,
    /// Files that are not texts, in base64: even a damaged recipe is backed up unchanged.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub spoilt: BTreeMap<String, String>,
}

/// The seal covers the texts alone if there is nothing else, as in backups of earlier versions.
fn seal(files: &BTreeMap<String, String>, spoilt: &BTreeMap<String, String>) -> String {
    let all = if spoilt.is_empty() { serde_json::to_vec(files) } else { serde_json::to_vec(&(files, spoilt)) };
    hash_text(&all.expect("plain data"))
}

impl Backup {
    /// Reads the present state of a station.
    ///
    /// # Errors
    /// The folder is not a station, or a file in it cannot be read.
    pub fn of(station: &Path) -> Result<Backup> {
        let (mut files, mut spoilt) = (BTreeMap::new(), BTreeMap::new());
        let mut add = |name: String, path: &Path| -> Result<()> {
            match String::from_utf8(crate::files::read(path, MOST_BYTES)?) {
                Ok(text) => drop(files.insert(name, text)),
                Err(bytes) => drop(spoilt.insert(name, BASE64_STANDARD.encode(bytes.as_bytes()))),
            }
            Ok(())
        };
        // A station without settings has the defaults.
        if FOLDERS.iter().all(|f| !station.join(f).is_dir()) || station.join(SETTINGS).exists() {
            add(SETTINGS.into(), &station.join(SETTINGS))?;
        }
        for folder in FOLDERS {
            for entry in std::fs::read_dir(station.join(folder)).into_iter().flatten().flatten() {
                let name = entry.file_name().to_string_lossy().into_owned();
                // Locks, remains of a killed process, and links are not part of the content.
                if known(&name) && entry.file_type().is_ok_and(|t| t.is_file()) {
                    add(format!("{folder}/{name}"), &entry.path())?;
                }
            }
        }
        Ok(Backup {
            format: FORMAT,
            program: format!("sheetlight {}", env!("CARGO_PKG_VERSION")),
            created: jiff::Timestamp::now().to_string(),
            station: Settings::load(station).map(|s| s.name).unwrap_or_default(),
            seal: seal(&files, &spoilt),
            files,
            spoilt,
        })
    }

    /// Reads a file of [`Backup::store`].
    ///
    /// # Errors
    /// Another kind of file, another version, or a changed file.
    pub fn load(path: &Path) -> Result<Backup> {
        Backup::parse(&crate::files::read_text(path)?).map_err(|e| e.at(path.display()))
    }

    fn parse(text: &str) -> Result<Backup> {
        let strange = |what: String| {
            Fault::input(what)
                .cause("another file, edited, or cut off")
                .next("give a file that sheetlight station backup wrote")
        };
        let b: Backup =
            serde_json::from_str(text).map_err(|e| strange(format!("is not a backup of a station: {e}")))?;
        if b.format != FORMAT {
            return Err(strange(format!("is of format {}, this version reads {FORMAT}", b.format)));
        }
        if b.seal != seal(&b.files, &b.spoilt) {
            return Err(strange("its texts are not those that were backed up".into()));
        }
        let place = |name: &str| {
            name == SETTINGS || name.split_once('/').is_some_and(|(f, n)| FOLDERS.contains(&f) && known(n))
        };
        let count = b.files.len() + b.spoilt.len();
        if let Some(name) = b.files.keys().chain(b.spoilt.keys()).find(|n| !place(n)).filter(|_| count <= MOST_FILES) {
            return Err(strange(format!("{name:?} is no part of a station")));
        }
        if count > MOST_FILES || count == 0 {
            return Err(strange(format!("holds {count} files, 1 to {MOST_FILES} are a station")));
        }
        Ok(b)
    }

    /// Writes the backup to a file.
    pub fn store(&self, path: &Path) -> Result<()> {
        crate::files::write(path, serde_json::to_string_pretty(self).expect("plain data").as_bytes())
    }

    /// Restores a station to the state of the backup, completely or not at all. Other content of the station stays
    /// (jobs, recordings, logs).
    ///
    /// # Errors
    /// This version refuses the settings or calibrations of the backup, or the disk fails; the station is then
    /// unchanged.
    pub fn restore(&self, station: &Path) -> Result<()> {
        crate::files::make_folder(station)?;
        let _lock = Lock::take(station, "restore", "restore")?;
        let together = together(station);
        together.settle_locked()?;
        let part = together.begin()?;
        for folder in FOLDERS {
            crate::files::make_folder(&part.join(folder))?;
        }
        for (name, text) in &self.files {
            crate::files::write(&part.join(name), text.as_bytes())?;
        }
        for (name, bytes) in &self.spoilt {
            let bytes = BASE64_STANDARD.decode(bytes);
            let bytes =
                bytes.map_err(|e| Fault::input(format!("{name} in the backup: {e}")).next("give another one"))?;
            crate::files::write(&part.join(name), &bytes)?;
        }
        let checked = Settings::load(&part).and_then(|_| Rig::load(&part));
        if let Err(fault) = checked {
            // If it cannot be removed now, the next restore removes it.
            let _ = remove(&part);
            return Err(fault);
        }
        together.commit()
    }
}

/// Completes a restore that was interrupted.
pub fn settle_restore(station: &Path) -> Result<()> {
    together(station).settle()
}

fn together(station: &Path) -> Together<'_> {
    Together::new(station, "restore", |station, _| {
        remove(&station.join(SETTINGS))?;
        FOLDERS.iter().try_for_each(|f| remove(&station.join(f)))
    })
}

/// Whether a file name can belong to a station: letters, digits and characters that every file system accepts.
fn known(name: &str) -> bool {
    let ending = Path::new(name).extension().is_some_and(|e| ["toml", "json", "html"].iter().any(|k| e == *k));
    ending && !name.starts_with('.') && name.chars().all(|c| c.is_alphanumeric() || " ._-+()".contains(c))
}

/// The folder of a station's own backups.
pub fn backups(station: &Path) -> PathBuf {
    station.join("backups")
}

/// Backs a station up into its own folder of backups; returns the file's name there.
pub fn back_up_here(station: &Path, why: &str) -> Result<String> {
    let backup = Backup::of(station)?;
    let at = backup.created.split('.').next().unwrap_or_default().replace([':', '-'], "").replace('T', "-");
    crate::files::make_folder(&backups(station))?;
    let free = |k: &u32| !backups(station).join(name(&at, why, *k)).exists();
    let name = name(&at, why, (0..).find(free).unwrap_or(0));
    backup.store(&backups(station).join(&name))?;
    Ok(name)
}

fn name(at: &str, why: &str, k: u32) -> String {
    let again = if k == 0 { String::new() } else { format!("-{}", k + 1) };
    format!("{}-{why}{again}.json", at.trim_end_matches('Z'))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn put(station: &Path, name: &str, text: &str) {
        let path = station.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }

    fn station() -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        put(dir.path(), "station.toml", "name = 'a' # mine\n");
        put(dir.path(), "recipes/one.toml", "first");
        put(dir.path(), "jobs/0001-scan/job.json", "{}");
        dir
    }

    #[test]
    fn a_station_comes_back_as_it_was_and_jobs_stay() {
        let dir = station();
        let read = |name: &str| std::fs::read_to_string(dir.path().join(name)).ok();
        let file = dir.path().join("b.json");
        Backup::of(dir.path()).unwrap().store(&file).unwrap();
        put(dir.path(), "station.toml", "name = 'b'\n");
        put(dir.path(), "recipes/one.toml", "second");
        put(dir.path(), "recipes/two.toml", "more");
        let later = back_up_here(dir.path(), "before").unwrap();
        Backup::load(&file).unwrap().restore(dir.path()).unwrap();
        assert_eq!(read("station.toml").as_deref(), Some("name = 'a' # mine\n"));
        assert_eq!((read("recipes/one.toml").as_deref(), read("recipes/two.toml")), (Some("first"), None));
        assert!(read("jobs/0001-scan/job.json").is_some() && read("b.json").is_some(), "what is no part of it stays");
        Backup::load(&backups(dir.path()).join(&later)).unwrap().restore(dir.path()).unwrap();
        assert_eq!(read("recipes/two.toml").as_deref(), Some("more"), "the way back from the way back");
        assert_ne!(back_up_here(dir.path(), "before").unwrap(), back_up_here(dir.path(), "before").unwrap());
    }

    #[test]
    fn what_is_no_backup_changes_nothing() {
        let dir = station();
        let good = Backup::of(dir.path()).unwrap();
        let refused = |change: &dyn Fn(&mut Backup)| {
            let mut b = good.clone();
            change(&mut b);
            b.seal = seal(&b.files, &b.spoilt);
            let text = serde_json::to_string(&b).unwrap();
            Backup::parse(&text).and_then(|b| b.restore(dir.path())).unwrap_err().what
        };
        let add = |name: &'static str| move |b: &mut Backup| drop(b.files.insert(name.into(), String::new()));
        for name in [
            "../x.toml",
            "/etc/x.toml",
            "recipes/../../x.toml",
            "jobs/x.json",
            "recipes/.x.toml",
            "recipes/a/b.toml",
            "recipes/x.sh",
        ] {
            assert!(refused(&add(name)).contains("no part of a station"), "{name}");
        }
        assert!(refused(&|b| b.files.clear()).contains("holds 0 files"));
        assert!(refused(&|b| drop(b.files.insert("station.toml".into(), "nam = 1".into()))).contains("nam"));
        assert!(refused(&add("calibration/camera.json")).contains("camera.json"));
        let edited = serde_json::to_string(&good).unwrap().replace("first", "other");
        assert!(Backup::parse(&edited).unwrap_err().what.contains("not those"));
        let text = std::fs::read_to_string(dir.path().join("station.toml")).unwrap();
        assert_eq!(text, "name = 'a' # mine\n");
        assert!(dir.path().join("recipes/one.toml").is_file() && !dir.path().join("restore.part").exists());
    }
}
