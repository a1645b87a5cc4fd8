//! In: a calibration that drives itself, while it runs or afterwards. Out: its newest pictures with the corners that were found.
//! Frame and unit: px of the picture.

use super::super::jobs::Jobs;
use crate::calibrate::boards::{FindOptions, find};
use crate::fault::Result;
use crate::recording::Recording;
use crate::web::message::BoardView;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Mutex;

/// Pictures that are shown.
const NEWEST: usize = 6;
/// Pictures whose corners are remembered.
const REMEMBERED: usize = 64;

/// Corners of pictures that were looked at before.
#[derive(Default)]
pub struct Views(Mutex<BTreeMap<PathBuf, BoardView>>);

impl Views {
    /// The newest pictures of a job, the newest one last. None while there are none.
    pub fn of(&self, jobs: &Jobs, id: &str) -> Result<Vec<BoardView>> {
        let job = jobs.get(id)?;
        let folder = jobs.folder(&job);
        // A job that was resumed began in another folder beside the former one.
        let names = (0..).map(|k| if k == 0 { "pictures".into() } else { format!("pictures-{k}") });
        let Some(pictures) = names.take_while(|n: &String| folder.join(n).is_dir()).last() else {
            return Ok(Vec::new());
        };
        let line = folder.join(&pictures).join("line");
        if !line.join("meta.json").is_file() {
            return Ok(Vec::new());
        }
        let recording = Recording::open(&line)?;
        let names = recording.meta.frames.iter().filter_map(|f| f.ambient.clone());
        let names: Vec<String> = names.collect();
        let newest = names.iter().skip(names.len().saturating_sub(NEWEST));
        newest.map(|name| self.one(&recording, name, &format!("{pictures}/line/{name}"))).collect()
    }

    fn one(&self, recording: &Recording, name: &str, file: &str) -> Result<BoardView> {
        let path = recording.folder.join(name);
        let mut known = self.0.lock().unwrap_or_else(|e| e.into_inner());
        if let Some(view) = known.get(&path) {
            return Ok(view.clone());
        }
        let picture = recording.picture(name)?;
        let seen = recording.meta.board.as_ref().and_then(|b| find(&picture, b, &FindOptions::default()).ok());
        let view = BoardView {
            name: name.trim_start_matches("ambient_").trim_end_matches(".png").into(),
            file: file.into(),
            width: picture.width,
            height: picture.height,
            corners: seen.map_or_else(Vec::new, |s| s.points.iter().map(|p| [p.pixel.x, p.pixel.y]).collect()),
        };
        while known.len() >= REMEMBERED {
            known.pop_first();
        }
        known.insert(path, view.clone());
        Ok(view)
    }
}
