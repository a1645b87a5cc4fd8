//! In: a manifest, a share of it, a station, a recipe, settings. Out: the results of every recording of the share, one
//! after the other, and a line of each. One that fails is named with its reason, and the others go on.
//! Frame and unit: the scans' frame; mm, degrees; poses in the robot's notation.

use super::identity::BatchOptions;
use super::manifest::Manifest;
use super::one::Bench;
use super::plan::{Folder, Planned};
use super::rows::{Line, State};
use super::shard::Shard;
use crate::capture::Latency;
use crate::fault::{Fault, Result};
use crate::find::Recipe;
use crate::rig::Rig;
use crate::station::edit::changed;
use crate::station::settings::Settings;
use std::sync::atomic::Ordering;

/// What came of a share.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Tally {
    /// Recordings that came to what was wanted.
    pub done: u64,
    /// Those without cloud or pose, whose results say why.
    pub refused: u64,
    /// Those that are missing or changed.
    pub failed: u64,
}

impl Tally {
    /// All of them.
    pub fn recordings(&self) -> u64 {
        self.done + self.refused + self.failed
    }
}

/// Makes the batch's folder and checks that it holds this batch; scans nothing.
///
/// # Errors
/// Settings or a station that cannot be, a folder with another batch, the disk.
pub fn plan(manifest: &Manifest, options: &BatchOptions) -> Result<Planned> {
    bench(manifest, options)?.folder.planned()
}

/// Scans the recordings of a share and looks for the part in each; `each` hears of every one as it comes, and ends the
/// run by false. What has results already is not scanned again.
///
/// # Errors
/// Those of [`plan`], a full disk, a device that failed; it was stopped.
pub fn batch(
    manifest: &Manifest,
    shard: Shard,
    options: &BatchOptions,
    mut each: impl FnMut(&Line) -> bool,
) -> Result<Tally> {
    let bench = bench(manifest, options)?;
    let (mut tally, mut place) = (Tally::default(), 0);
    manifest.each(|entry| {
        let mine = shard.has(place);
        place += 1;
        if !mine {
            return Ok(());
        }
        let line = (!stopped(options)).then(|| bench.one(&entry, &manifest.folder(&entry)));
        // Whatever a scan says of a signal, it was the signal.
        let (Some(line), false) = (line, stopped(options)) else {
            return Err(ended("stopped by a signal", &tally, "Ctrl-C, or the session or the machine was closed"));
        };
        let line = line?;
        *match line.state {
            State::Done => &mut tally.done,
            State::Refused => &mut tally.refused,
            State::Failed => &mut tally.failed,
        } += 1;
        if each(&line) {
            return Ok(());
        }
        Err(ended("nobody reads the lines any more", &tally, "the program that started this one has ended"))
    })?;
    Ok(tally)
}

fn stopped(options: &BatchOptions) -> bool {
    options.stop.load(Ordering::Relaxed)
}

fn ended(why: &str, tally: &Tally, cause: &str) -> Fault {
    Fault::refused(format!("{why} after {} recordings", tally.recordings()))
        .cause(cause)
        .next("run the same command again: recordings with results are not scanned again")
}

fn bench<'a>(manifest: &Manifest, options: &'a BatchOptions) -> Result<Bench<'a>> {
    let settings = changed(&Settings::load(&options.station)?, "extraction", &options.settings)?;
    Ok(Bench {
        settings,
        rig: Rig::load(&options.station)?,
        latency: Latency::load(&options.station)?,
        recipe: options.recipe.as_deref().map(Recipe::load).transpose()?,
        folder: Folder::plan(manifest, options)?,
        options,
    })
}
