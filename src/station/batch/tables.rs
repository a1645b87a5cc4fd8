//! In: what came of each recording, in the manifest's order. Out: the rows of the tables: recordings, shots, matches,
//! figures.
//! Frame and unit: the scans' frame; units stand in the columns' names.

use super::manifest::Entry;
use super::parquet::{Cell, Kind, ParquetFile};
use super::rows::{BatchRow, FoundAt};
use crate::fault::Result;
use std::path::Path;

use Kind::{Real, Text, Truth, Whole};

const RECORDINGS: [(&str, Kind); 13] = [
    ("recording", Text),
    ("input", Text),
    ("results", Text),
    ("state", Text),
    ("problem", Text),
    ("cause", Text),
    ("next", Text),
    ("frame", Text),
    ("shots", Whole),
    ("points", Whole),
    ("median_sigma_mm", Real),
    ("coverage", Real),
    ("recipe", Text),
];
const SHOTS: [(&str, Kind); 11] = [
    ("recording", Text),
    ("shot", Whole),
    ("camera_x_mm", Real),
    ("camera_y_mm", Real),
    ("camera_z_mm", Real),
    ("points", Whole),
    ("mean_x_mm", Real),
    ("mean_y_mm", Real),
    ("mean_z_mm", Real),
    ("sigma_mm", Real),
    ("intensity", Real),
];
const MATCHES: [(&str, Kind); 24] = [
    ("recording", Text),
    ("recipe", Text),
    ("passed", Truth),
    ("score", Real),
    ("x_mm", Real),
    ("y_mm", Real),
    ("z_mm", Real),
    ("turn_deg", Real),
    ("r11", Real),
    ("r12", Real),
    ("r13", Real),
    ("r21", Real),
    ("r22", Real),
    ("r23", Real),
    ("r31", Real),
    ("r32", Real),
    ("r33", Real),
    ("sigma_x_mm", Real),
    ("sigma_y_mm", Real),
    ("sigma_z_mm", Real),
    ("sigma_rx_deg", Real),
    ("sigma_ry_deg", Real),
    ("sigma_rz_deg", Real),
    ("insertion", Text),
];
const FIGURES: [(&str, Kind); 3] = [("recording", Text), ("figure", Text), ("value", Real)];

/// The names of the tables' files.
pub(super) const FILES: [&str; 4] = ["recordings.parquet", "shots.parquet", "matches.parquet", "figures.parquet"];

/// The tables under way.
pub(super) struct Tables {
    recordings: ParquetFile,
    shots: ParquetFile,
    matches: ParquetFile,
    figures: ParquetFile,
}

impl Tables {
    /// Empty ones in a folder.
    pub fn create(folder: &Path) -> Result<Tables> {
        let [recordings, shots, matches, figures] = FILES.map(|name| folder.join(name));
        Ok(Tables {
            recordings: ParquetFile::create(&recordings, "recordings", &RECORDINGS)?,
            shots: ParquetFile::create(&shots, "shots", &SHOTS)?,
            matches: ParquetFile::create(&matches, "matches", &MATCHES)?,
            figures: ParquetFile::create(&figures, "figures", &FIGURES)?,
        })
    }

    /// Adds a recording; `row` is what came of it, where it has results.
    pub fn add(&mut self, entry: &Entry, results: String, row: Option<&BatchRow>) -> Result<()> {
        self.recordings.push(recording(entry, results, row))?;
        let Some(row) = row else { return Ok(()) };
        let name = || Cell::Text(entry.name.clone());
        for s in &row.shot_rows {
            let mean = s.mean_mm.map_or([Cell::Nothing, Cell::Nothing, Cell::Nothing], |m| m.map(Cell::Real));
            let cells = [name(), Cell::Whole(s.shot.into())].into_iter().chain(s.camera_mm.map(Cell::Real));
            let cells = cells.chain([Cell::Whole(s.points)]).chain(mean);
            self.shots.push(cells.chain([real(s.sigma_mm), real(s.intensity)]).collect())?;
        }
        if let Some(found) = &row.found {
            self.matches.push(matched(name(), row, found))?;
        }
        for (figure, value) in &row.figures {
            self.figures.push(vec![name(), Cell::Text(figure.clone()), Cell::Real(*value)])?;
        }
        Ok(())
    }

    /// Rows so far: of recordings, shots, matches, figures.
    pub fn rows(&self) -> [u64; 4] {
        [&self.recordings, &self.shots, &self.matches, &self.figures].map(ParquetFile::rows)
    }

    /// Waits until all are on the disk.
    pub fn close(self) -> Result<()> {
        [self.recordings, self.shots, self.matches, self.figures].into_iter().try_for_each(ParquetFile::close)
    }
}

fn real(v: Option<f64>) -> Cell {
    v.map_or(Cell::Nothing, Cell::Real)
}

fn text(v: Option<&str>) -> Cell {
    v.map_or(Cell::Nothing, |v| Cell::Text(v.to_owned()))
}

fn recording(entry: &Entry, results: String, row: Option<&BatchRow>) -> Vec<Cell> {
    let problem = row.and_then(|r| r.problem.as_ref());
    let state = row.map_or("missing", |r| if r.problem.is_some() { "refused" } else { "done" });
    let whole = |v: Option<u64>| v.map_or(Cell::Nothing, Cell::Whole);
    vec![
        Cell::Text(entry.name.clone()),
        Cell::Text(entry.input.clone()),
        row.map_or(Cell::Nothing, |_| Cell::Text(results)),
        Cell::Text(state.into()),
        text(problem.map(|p| p.what.as_str())),
        text(problem.map(|p| p.cause.as_str())),
        text(problem.map(|p| p.next.as_str())),
        text(row.and_then(|r| r.frame.as_deref())),
        whole(row.and_then(|r| r.shots)),
        whole(row.and_then(|r| r.points)),
        real(row.and_then(|r| r.median_sigma_mm)),
        real(row.and_then(|r| r.coverage)),
        text(row.and_then(|r| r.recipe.as_deref())),
    ]
}

fn matched(name: Cell, row: &BatchRow, found: &FoundAt) -> Vec<Cell> {
    let p = &found.part;
    let turn = p[4].atan2(p[0]).to_degrees();
    let reals = [found.score, p[3], p[7], p[11], turn].into_iter();
    let reals = reals.chain([0, 1, 2, 4, 5, 6, 8, 9, 10].map(|k| p[k]));
    let reals = reals.chain(found.sigma_mm).chain(found.sigma_deg).map(Cell::Real);
    let pose = found.insertion.as_ref().map(|v| v.iter().map(f64::to_string).collect::<Vec<_>>().join(" "));
    [name, text(row.recipe.as_deref()), Cell::Truth(found.passed)]
        .into_iter()
        .chain(reals)
        .chain([text(pose.as_deref())])
        .collect()
}
