//! In: a batch's folder. Out: its tables: recordings, shots, matches and figures as Parquet, recordings as CSV, and how
//! the poses of the part repeat; equal results give equal bytes, whoever made them in whatever order.
//! Frame and unit: as the tables say.

use super::manifest::Entry;
use super::plan::Folder;
use super::repeats::{Placed, Repeats, repeats};
use super::rows::FoundAt;
use super::tables::{FILES, Tables};
use super::text;
use crate::fault::{Fault, Result};
use crate::files::{Aside, Lock, Together, moment, remove};
use std::io::{BufWriter, Result as Io, Write};
use std::path::Path;

const TEXT: &str = "recordings.csv";
const REPEATS: &str = "repeats.json";
/// How a part repeats is a question about some dozen recordings; of more poses than this it is not answered.
const MOST_PLACES: usize = 10_000;

/// What was merged.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Merged {
    /// Recordings of the manifest.
    pub recordings: u64,
    /// Those whose results say why there is no cloud or no pose.
    pub refused: u64,
    /// Those without results.
    pub missing: u64,
    /// The first of those.
    pub first_missing: Option<String>,
    /// Rows of the tables shots, matches and figures.
    pub rows: [u64; 3],
    /// Of the poses that were found; none of fewer than two, or of more than 10,000.
    pub repeats: Option<Repeats>,
}

/// Makes the tables of a batch from the results that are there. Recordings without results are rows that say so.
///
/// # Errors
/// A folder without a batch, results that were changed, the disk. The tables get their names together, or none does.
pub fn merge(out: &Path) -> Result<Merged> {
    let folder = Folder::open(out)?;
    let _lock = Lock::take(out, "tables", "merge")?;
    let set = Together::new(out, "tables", clear);
    set.settle_locked()?;
    let part = set.begin()?;
    let done = written(&folder, &part).and_then(|merged| set.commit().map(|()| merged));
    if done.is_err() {
        set.abandon();
    }
    done
}

fn clear(out: &Path, _: &Path) -> Io<()> {
    FILES.iter().chain(&[TEXT, REPEATS]).try_for_each(|name| remove(&out.join(name)))
}

fn written(folder: &Folder, part: &Path) -> Result<Merged> {
    let mut tables = Tables::create(part)?;
    let mut lines = Lines::create(&part.join(TEXT))?;
    let mut placed: Vec<Placed> = Vec::new();
    let mut merged = Merged { recordings: 0, refused: 0, missing: 0, first_missing: None, rows: [0; 3], repeats: None };
    folder.manifest()?.each(|entry| {
        let key = folder.identity.key(&entry.input);
        let (row, results) = (folder.row(&key)?, Folder::results(&key));
        lines.add(&text::line(&entry, &results, row.as_ref()))?;
        tables.add(&entry, results, row.as_ref())?;
        if placed.len() <= MOST_PLACES {
            // A pose that missed a gate says nothing about how the part repeats.
            let passed = row.iter().filter_map(|r| r.found.as_ref()).filter(|f| f.passed);
            placed.extend(passed.filter_map(FoundAt::placed));
        }
        count(&mut merged, &entry, row.map(|r| r.problem.is_some()));
        Ok(())
    })?;
    let [_, shots, matches, figures] = tables.rows();
    tables.close()?;
    lines.close()?;
    if placed.len() <= MOST_PLACES {
        merged.repeats = repeats(&placed);
    }
    merged.rows = [shots, matches, figures];
    let json = serde_json::to_string_pretty(&merged.repeats).expect("plain data");
    crate::files::write(&part.join(REPEATS), json.as_bytes())?;
    Ok(merged)
}

fn count(merged: &mut Merged, entry: &Entry, refused: Option<bool>) {
    merged.recordings += 1;
    match refused {
        Some(refused) => merged.refused += u64::from(refused),
        None => {
            merged.missing += 1;
            merged.first_missing.get_or_insert_with(|| entry.name.clone());
        }
    }
}

/// A text that is written line by line.
struct Lines {
    aside: Aside,
    to: BufWriter<std::fs::File>,
    path: std::path::PathBuf,
}

impl Lines {
    fn create(path: &Path) -> Result<Lines> {
        let aside = Aside::create(path)?;
        let to = BufWriter::new(aside.file().try_clone().map_err(|e| Fault::write(path, e))?);
        let mut lines = Lines { aside, to, path: path.to_owned() };
        lines.add(text::COLUMNS)?;
        Ok(lines)
    }

    fn add(&mut self, line: &str) -> Result<()> {
        self.to.write_all(line.as_bytes()).map_err(|e| Fault::write(&self.path, e))
    }

    fn close(mut self) -> Result<()> {
        moment().and_then(|()| self.to.flush()).map_err(|e| Fault::write(&self.path, e))?;
        self.aside.keep()
    }
}
