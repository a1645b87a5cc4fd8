//! In: a station. Out: its settings changed by name, all its settings and measurements in one file, and their
//! restoration.
//! Frame and unit: stated for each setting in docs/file-formats.md.

use crate::cli::terminal::arguments;
use crate::cli::terminal::console::Console;
use crate::cli::terminal::outputs;
use crate::cli::terminal::outputs::Inputs;
use sheetlight::fault::Result;
use sheetlight::station::{Backup, back_up_here, edited};
use std::path::PathBuf;

/// Change settings of station.toml; comments stay
///
/// Names with dots: robot, tolerance_mm, working_volume.near_mm, motion.speed_mm_s, extraction.threshold.minimum. A
/// name with nothing behind the = removes the setting. An invalid setting is refused, and then nothing is changed.
#[derive(clap::Args)]
#[command(after_help = "Example:
  sheetlight station set robot=ur tolerance_mm=0.05 motion.speed_mm_s=40 --station cell3
Guide: docs/operator.md")]
pub struct Set {
    /// NAME=VALUE; may be repeated
    #[arg(required = true)]
    settings: Vec<String>,
    /// Station folder
    #[arg(long)]
    station: PathBuf,
}

/// Back up settings, calibrations, recipes and boards into one file
#[derive(clap::Args)]
#[command(after_help = "Example:
  sheetlight station backup --station cell3 --out cell3.json
Guide: docs/operator.md")]
pub struct BackUp {
    /// Station folder
    #[arg(long)]
    station: PathBuf,
    /// File for the backup (JSON)
    #[arg(long)]
    out: PathBuf,
}

/// Restore a backup; the present state is backed up first, jobs stay
#[derive(clap::Args)]
#[command(after_help = "Example:
  sheetlight station restore cell3.json --station cell3
Guide: docs/operator.md")]
pub struct Restore {
    /// File from sheetlight station backup
    backup: PathBuf,
    /// Station folder; created if missing
    #[arg(long)]
    station: PathBuf,
}

pub fn set(args: &Set, console: &Console) -> Result<()> {
    let path = args.station.join("station.toml");
    let text = sheetlight::files::read_text(&path)?;
    let new = edited(&text, &arguments::changes(&args.settings)?).map_err(|e| e.at(path.display()))?;
    sheetlight::files::write(&path, new.as_bytes())?;
    console.result(&args.settings, &format!("{}: changed", path.display()));
    Ok(())
}

pub fn back_up(args: &BackUp, console: &Console) -> Result<()> {
    outputs::check(&[&args.out], &Inputs { station: Some(&args.station), ..Inputs::default() })?;
    let backup = Backup::of(&args.station)?;
    backup.store(&args.out)?;
    let names: Vec<&String> = backup.files.keys().collect();
    console.result(&names, &format!("{}: {} files of '{}'", args.out.display(), names.len(), backup.station));
    Ok(())
}

pub fn restore(args: &Restore, console: &Console) -> Result<()> {
    let backup = Backup::load(&args.backup)?;
    if args.station.join("station.toml").exists() {
        let name = back_up_here(&args.station, "before-restore")?;
        console.say(format!("the present state is in {}", args.station.join("backups").join(name).display()));
    }
    backup.restore(&args.station)?;
    console.result(
        &backup.files.keys().collect::<Vec<_>>(),
        &format!("{}: as it was at {}", args.station.display(), backup.created),
    );
    Ok(())
}
