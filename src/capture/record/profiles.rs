//! In: a running 3-D camera that sends profiles, paired with the robot's poses. Out: a folder of profiles with their
//! poses, as `scan-profiles` reads them.
//! Frame and unit: docs/file-formats.md.

use super::run::{ROOM, Recording, next_shot};
use super::space::Space;
use crate::capture::account::Account;
use crate::capture::feed::Fate;
use crate::capture::pair::Paired;
use crate::capture::stream::Stream;
use crate::fault::{Fault, Result};
use crate::files::Lock;
use crate::recording::profiles::ProfileWriter;
use crate::recording::{Sources, Stand};
use std::path::Path;

/// Whether each row of a picture may be a profile of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rows {
    /// Nothing is paired: profiles have no poses.
    Unposed,
    /// What moves stands still at each picture: all of its rows have its pose.
    Standing,
    /// What moves goes on: a pose is known of a picture, not of its rows.
    Moving,
}

/// Records profiles until the stream ends. `sources` names the camera and the source of the poses. `say` receives
/// messages for the user, and the account at intervals.
///
/// # Errors
/// A folder with a recording, a camera whose pictures have several rows while it moves, a full disk; the fault that
/// ended the stream.
pub fn record_profiles(
    stream: &mut Stream,
    folder: &Path,
    rows: Rows,
    sources: &Sources,
    mut say: impl FnMut(&Stream, Option<String>),
) -> Result<Recording> {
    let height = stream.format().height;
    if rows == Rows::Moving && height > 1 {
        return Err(Fault::usage(format!(
            "Height is {height}: a pose is known of each picture, not of each of its rows"
        ))
        .cause("the camera gathers several profiles into a picture, and the robot goes on meanwhile")
        .next("set one row: sheetlight camera set Height 1; or stand still at each picture: --pair step"));
    }
    crate::files::make_folder(folder)?;
    let _lock = Lock::take(folder, "record", "recorder")?;
    if folder.join("meta.json").exists() || folder.join(SOURCE).exists() {
        return Err(Fault::output(format!("{}: holds a recording", folder.display()))
            .cause("the same --out was given before")
            .next("record into another folder"));
    }
    let mut writer = ProfileWriter::create(folder, rows != Rows::Unposed)?;
    let told = stream.feed().coordinates().and_then(|text| serde_json::from_str(text).ok());
    let source = Source { camera: &sources.camera, poses: sources.poses.as_deref(), coordinates: told };
    let text = serde_json::to_string_pretty(&source).expect("plain data");
    crate::files::write(&folder.join(SOURCE), text.as_bytes())?;
    let mut space = Space::of(folder);
    let mut full: Option<Fault> = None;
    let ended = loop {
        let shot = match next_shot(stream, &mut say) {
            Ok(shot) => shot,
            Err(ended) => break ended,
        };
        if full.is_some() {
            stream.fate(Fate::Disk);
            continue;
        }
        match add(&mut writer, &shot) {
            Ok(()) => stream.fate(Fate::Used),
            Err(fault) => {
                stream.fate(Fate::Disk);
                stream.feed().stop();
                full = Some(fault.next(ROOM));
            }
        }
        if let Some(said) = space.warn(folder, writer.bytes()) {
            say(stream, Some(said));
        }
    };
    stream.news().into_iter().for_each(|s| say(stream, Some(s)));
    writer.sync()?;
    let left_out = stream.left_out().to_vec();
    if !left_out.is_empty() {
        let text = serde_json::to_string_pretty(&left_out).expect("plain data");
        crate::files::write(&folder.join("left_out.json"), text.as_bytes())?;
    }
    let (shots, bytes, account): (usize, u64, Account) = (writer.count(), writer.bytes(), stream.account());
    match full.or(ended) {
        Some(fault) => {
            let what = format!("{}; {} holds {shots} profiles, whole", fault.what, folder.display());
            Err(Fault { what, ..fault })
        }
        None => Ok(Recording { shots, bytes, account, left_out, exposures: None }),
    }
}

/// What was recorded.
const SOURCE: &str = "source.json";

/// Content of that file.
#[derive(serde::Serialize)]
struct Source<'a> {
    camera: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    poses: Option<&'a str>,
    /// What the camera stated about its coordinates.
    coordinates: Option<serde_json::Value>,
}

fn add(writer: &mut ProfileWriter, shot: &Paired) -> Result<()> {
    let pose = match &shot.stand {
        Some(Stand::Robot(pose)) => Some(pose),
        _ => None,
    };
    let mut rows = shot.picture.profiles.iter().flatten();
    rows.try_for_each(|row| writer.add(row, pose))
}
