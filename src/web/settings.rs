//! In: what an operator changes of the station. Out: its station.toml changed, backed up before, or a refusal;
//! backups and the way back.
//! Frame and unit: none.

use super::message::{BackupInfo, SettingsAsk, SettingsState};
use super::screen::Screen;
use super::station::flatten;
use crate::fault::{Fault, Result};
use crate::rig::hash_text;
use crate::robot::Convention;
use crate::station::{Backup, Settings, back_up_here, backups, edited};
use crate::web::guard::resolve;
use std::collections::BTreeMap;

/// Backups that are listed.
const MOST: usize = 100;

/// As they stand on the disk.
pub fn state(screen: &Screen) -> Result<SettingsState> {
    let place = &screen.place;
    let text = crate::files::read_text(&place.station.join("station.toml"))?;
    let mut values = BTreeMap::new();
    if let Ok(settings) = Settings::parse(&text) {
        flatten("", &serde_json::to_value(&settings).expect("plain data"), &mut values);
    }
    let shown = |p: &std::path::Path| std::path::absolute(p).unwrap_or_else(|_| p.to_owned()).display().to_string();
    Ok(SettingsState {
        sha256: hash_text(text.as_bytes()),
        text,
        values,
        notations: Convention::ALL.iter().map(|c| c.name().to_owned()).collect(),
        folder: shown(&place.station),
        recordings: shown(&place.recordings),
        secured: screen.password.is_some(),
        backups: listed(screen),
    })
}

fn listed(screen: &Screen) -> Vec<BackupInfo> {
    let folder = backups(&screen.place.station);
    let entries = std::fs::read_dir(&folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.sort_unstable_by(|a, b| b.cmp(a));
    let info = |name: String| {
        let path = folder.join(&name);
        let backup = Backup::load(&path).ok()?;
        let bytes = path.metadata().map_or(0, |m| m.len());
        Some(BackupInfo { name, created: backup.created, files: backup.files.len(), bytes })
    };
    names.into_iter().take(MOST).filter_map(info).collect()
}

/// Changes them; the former ones lie in a backup.
///
/// # Errors
/// Settings that cannot be; a text that was changed by another meanwhile; while a job runs or the robot is armed.
pub fn change(screen: &Screen, ask: &SettingsAsk) -> Result<SettingsState> {
    free(screen)?;
    let path = screen.place.station.join("station.toml");
    let text = crate::files::read_text(&path)?;
    if hash_text(text.as_bytes()) != ask.sha256 {
        return Err(Fault::refused("station.toml changed since this page loaded")
            .cause("another screen or an editor has changed station.toml since this page read it")
            .next("load the page again and make the change there"));
    }
    let new = match &ask.text {
        Some(new) if ask.changes.is_empty() => {
            Settings::parse(new)?;
            new.clone()
        }
        None => edited(&text, &ask.changes)?,
        Some(_) => return Err(Fault::usage("a whole text and single settings in one request").next("send one of them")),
    };
    if new != text {
        back_up_here(&screen.place.station, "before-settings")?;
        crate::files::write(&path, new.as_bytes())?;
        screen.forget();
    }
    state(screen)
}

/// Backs the station up into its own folder.
pub fn back_up(screen: &Screen) -> Result<SettingsState> {
    back_up_here(&screen.place.station, "by-hand")?;
    state(screen)
}

/// Puts the station into the state of one of its backups; the present one is backed up before.
pub fn restore(screen: &Screen, name: &str) -> Result<SettingsState> {
    free(screen)?;
    let backup = Backup::load(&resolve(&backups(&screen.place.station), name)?)?;
    back_up_here(&screen.place.station, "before-restore")?;
    backup.restore(&screen.place.station)?;
    screen.forget();
    state(screen)
}

/// One of them, to keep elsewhere.
pub fn backup(screen: &Screen, name: &str) -> Result<Vec<u8>> {
    let path = resolve(&backups(&screen.place.station), name)?;
    Backup::load(&path)?;
    crate::files::read(&path, 64 << 20)
}

/// Refuses while something works with the settings as they are.
fn free(screen: &Screen) -> Result<()> {
    if let Some(job) = screen.jobs.running() {
        return Err(Fault::refused(format!("{job} runs"))
            .cause("it uses the present settings")
            .next("wait until it has ended, or stop it"));
    }
    if screen.desk.armed() {
        return Err(Fault::refused("the robot is armed")
            .cause("its limits were read when it was armed, and apply until it is released")
            .next("give the arm back, then change the settings"));
    }
    Ok(())
}
