//! In: the program's start options. Out: the folders of a station, and the recordings that are there.
//! Frame and unit: px.

use crate::procedure::suits;
use crate::web::guard::plain;
use crate::web::message::{Mode, Problem, RecordingInfo};
use sheetlight::capture::record::is_recorded_into;
use sheetlight::fault::{Fault, Result};
use sheetlight::files::natural;
use sheetlight::recording::{Beam, BoardSpec, MotionKind, Recording};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Depth to which folders below the recordings' root are searched.
const DEEPEST: usize = 3;
/// Most recordings that are listed.
const MOST: usize = 500;

/// Folders of one station.
#[derive(Clone, Debug)]
pub struct Place {
    /// The station: station.toml and calibrations; jobs and recipes are stored in it.
    pub station: PathBuf,
    /// Folder that contains the recordings.
    pub recordings: PathBuf,
    /// Source of the pictures.
    pub mode: Mode,
}

impl Place {
    /// Folder of the jobs, with one folder per job.
    pub fn jobs(&self) -> PathBuf {
        self.station.join("jobs")
    }
    /// Recipes of this station.
    pub fn recipes(&self) -> PathBuf {
        self.station.join("recipes")
    }

    /// Names of the boards that the station describes, in natural order.
    pub fn boards(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.station.join("boards")).into_iter().flatten().flatten();
        let name = |e: std::fs::DirEntry| {
            let path = e.path();
            let name = path.file_stem()?.to_string_lossy().into_owned();
            (path.extension()? == "json" && plain(&name)).then_some(name)
        };
        let mut names: Vec<String> = entries.filter_map(name).collect();
        names.sort_by_key(|n| natural(n));
        names
    }

    /// The description of one.
    ///
    /// # Errors
    /// The station has none of that name, or it cannot be read.
    pub fn board(&self, name: &str) -> Result<BoardSpec> {
        if !self.boards().iter().any(|b| b == name) {
            return Err(Fault::input(format!("{name:?}: is not a board of this station"))
                .cause("its folder boards has no such description")
                .next("write one with sheetlight board, and put its .json into STATION/boards"));
        }
        BoardSpec::load(&self.station.join("boards").join(format!("{name}.json")))
    }

    /// The recordings below their folder, in natural order. One that cannot be read is listed with the reason.
    ///
    /// # Errors
    /// The folder cannot be read.
    pub fn listed(&self) -> Result<Vec<RecordingInfo>> {
        let mut found = Vec::new();
        list(&self.recordings, "", DEEPEST, &mut found)?;
        found.sort_by_key(|r| natural(&r.name));
        Ok(found)
    }

    /// Name of the newest complete recording that suits: readable, with pictures, and no recorder writes into it. The
    /// newest one has the latest meta.json, which a recorder writes first. Of several at the same time it is the last
    /// in the list.
    ///
    /// # Errors
    /// The folder cannot be read or has too many recordings, or there is none; `what` says which is wanted.
    pub fn newest(&self, suits: impl Fn(&RecordingInfo) -> bool, what: &str) -> Result<String> {
        let folder = |r: &RecordingInfo| self.recordings.join(&r.name);
        let complete = |r: &RecordingInfo| r.problem.is_none() && r.frames > 0 && !is_recorded_into(&folder(r));
        let listed = self.listed()?;
        if listed.len() >= MOST {
            return Err(Fault::refused(format!(
                "{MOST} recordings or more: not all are listed, so the newest is unknown"
            ))
            .cause("the recordings' folder has grown")
            .next("name a recording, or put old ones into another folder"));
        }
        let suitable = listed.into_iter().filter(|r| suits(r) && complete(r));
        suitable.max_by_key(|r| begun(&folder(r))).map(|r| r.name).ok_or_else(|| {
            Fault::input(format!("no complete recording of {what} is in the recordings' folder"))
                .cause("nothing was recorded yet, a recorder still writes, or --recordings names another folder")
                .next("record first, or name a recording")
        })
    }
}

/// When a recording was begun; `None` sorts as the oldest.
fn begun(folder: &Path) -> Option<SystemTime> {
    folder.join("meta.json").metadata().and_then(|m| m.modified()).ok()
}

fn list(folder: &Path, name: &str, depth: usize, out: &mut Vec<RecordingInfo>) -> Result<()> {
    if folder.join("meta.json").is_file() {
        out.push(info(folder, name));
        return Ok(());
    }
    let entries = std::fs::read_dir(folder).map_err(|e| Fault::read(folder, e))?;
    for entry in entries.flatten().filter(|_| depth > 0) {
        let word = entry.file_name().to_string_lossy().into_owned();
        // Links are not followed: they may lead outside or form a cycle.
        if plain(&word) && entry.file_type().is_ok_and(|t| t.is_dir()) && out.len() < MOST {
            let below = if name.is_empty() { word } else { format!("{name}/{word}") };
            // A folder that cannot be read is skipped; the others are listed.
            let _ = list(&entry.path(), &below, depth - 1, out);
        }
    }
    Ok(())
}

fn info(folder: &Path, name: &str) -> RecordingInfo {
    match Recording::open(folder) {
        Ok(r) => RecordingInfo {
            name: name.into(),
            set: r.meta.set.clone(),
            frames: r.meta.frames.len(),
            width: r.meta.image.width,
            height: r.meta.image.height,
            beam: r.meta.beam.map(|b| if b == Beam::Line { "line" } else { "pointer" }.to_owned()),
            board: r.meta.board.is_some() || !r.meta.boards.is_empty(),
            motion: match r.meta.motion().kind {
                MotionKind::Robot => "robot",
                MotionKind::Linear => "linear",
                MotionKind::Turntable => "turntable",
            }
            .into(),
            suits: suits(&r.meta).into_iter().map(str::to_owned).collect(),
            problem: None,
        },
        Err(fault) => RecordingInfo {
            name: name.into(),
            set: String::new(),
            frames: 0,
            width: 0,
            height: 0,
            beam: None,
            board: false,
            motion: String::new(),
            suits: Vec::new(),
            problem: Some(Problem::from(&fault)),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sheetlight::files::Lock;

    /// A folder with one picture's frame and no picture, begun at a time.
    fn put(place: &Place, name: &str, rest: &str, begun_s: u64) {
        let folder = place.recordings.join(name);
        std::fs::create_dir_all(&folder).unwrap();
        let image = r#"{"width":64,"height":48,"bits":8,"channels":1,"response":"linear","#;
        let meta = format!(
            r#"{{"format":1,"set":"s","units":"mm","image":{image}"pixel_centre":"integer coordinates"}}{rest}}}"#
        );
        std::fs::write(folder.join("meta.json"), meta).unwrap();
        let at = SystemTime::UNIX_EPOCH + std::time::Duration::from_secs(begun_s);
        std::fs::File::options().write(true).open(folder.join("meta.json")).unwrap().set_modified(at).unwrap();
    }

    #[test]
    fn the_newest_recording_is_complete_and_suits() {
        let dir = tempfile::tempdir().unwrap();
        let recordings = dir.path().join("recordings");
        std::fs::create_dir(&recordings).unwrap();
        let place = Place { station: dir.path().into(), recordings, mode: Mode::Replay };
        let newest = || place.newest(|r| r.beam.as_deref() != Some("pointer"), "the laser line");
        assert!(newest().unwrap_err().what.contains("no complete recording of the laser line"));
        let one = r#","frames":[{"laser":"a.png"}]"#;
        put(&place, "b/old", one, 100);
        put(&place, "a", one, 300);
        assert_eq!(newest().unwrap(), "a");
        put(&place, "b/new", one, 301);
        assert_eq!(newest().unwrap(), "b/new");
        put(&place, "b/new10", one, 301);
        assert_eq!(newest().unwrap(), "b/new10", "the last in the list");
        // None of these is taken, though they are newer.
        put(&place, "broken", ",", 400);
        put(&place, "empty", r#","frames_file":"frames.jsonl""#, 401);
        std::fs::write(place.recordings.join("empty/frames.jsonl"), "").unwrap();
        put(&place, "pointer", &format!(r#"{one},"beam":"pointer""#), 402);
        put(&place, ".hidden", one, 403);
        assert_eq!(newest().unwrap(), "b/new10");
        put(&place, "under-way", one, 404);
        let recorder = Lock::take(&place.recordings.join("under-way"), "record", "recorder").unwrap();
        assert_eq!(newest().unwrap(), "b/new10");
        drop(recorder);
        assert_eq!(newest().unwrap(), "under-way");
        (0..MOST).for_each(|k| put(&place, &format!("many/{k}"), one, 1));
        assert!(newest().unwrap_err().what.contains("the newest is unknown"));
    }
}
