//! In: an operator's changes to the station. Out: the changed station.toml, with a backup made before, or an error;
//! backups and restoring them.
//! Frame and unit: none.

use super::message::{BackupInfo, SettingsAsk, SettingsState};
use super::screen::Screen;
use super::station::flatten;
use crate::web::guard::resolve;
use sheetlight::fault::{Fault, Result};
use sheetlight::rig::hash_text;
use sheetlight::robot::Convention;
use sheetlight::station::{Backup, Settings, back_up_here, backups, edited};
use std::collections::BTreeMap;

/// Most backups that are listed.
const MOST: usize = 100;

/// The settings as stored on the disk.
pub fn state(screen: &Screen) -> Result<SettingsState> {
    let place = &screen.place;
    let text = sheetlight::files::read_text(&place.station.join("station.toml"))?;
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
        connections: screen.hub.links(),
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

/// Changes the settings; the previous ones are in a backup.
///
/// # Errors
/// Invalid settings; a text that was changed elsewhere meanwhile; a running job or an armed robot.
pub fn change(screen: &Screen, ask: &SettingsAsk) -> Result<SettingsState> {
    free(screen)?;
    let path = screen.place.station.join("station.toml");
    let text = sheetlight::files::read_text(&path)?;
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
        sheetlight::files::write(&path, new.as_bytes())?;
        screen.forget();
    }
    state(screen)
}

/// Backs the station up into its folder.
pub fn back_up(screen: &Screen) -> Result<SettingsState> {
    back_up_here(&screen.place.station, "by-hand")?;
    state(screen)
}

/// Restores the station from one of its backups; its present state is backed up before.
pub fn restore(screen: &Screen, name: &str) -> Result<SettingsState> {
    free(screen)?;
    let backup = Backup::load(&resolve(&backups(&screen.place.station), name)?)?;
    back_up_here(&screen.place.station, "before-restore")?;
    backup.restore(&screen.place.station)?;
    screen.forget();
    state(screen)
}

/// The bytes of a backup, to store elsewhere.
pub fn backup(screen: &Screen, name: &str) -> Result<Vec<u8>> {
    let path = resolve(&backups(&screen.place.station), name)?;
    Backup::load(&path)?;
    sheetlight::files::read(&path, 64 << 20)
}

/// Returns an error while the present settings are in use.
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
