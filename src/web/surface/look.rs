//! In: a scan's folder, the filters through which it is looked at. Out: its map through them; the filters are kept
//! beside the scan, so that reload, second tab and restart see the same.
//! Frame and unit: the height map's grid frame, mm.

use crate::fault::{Fault, Result};
use crate::scan::HeightMap;
use crate::station::{filter_map, load_report};
use crate::web::message::{Filtered, Filters};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// In the job's folder, beside the scan.
const KEPT: &str = "filters.json";

/// A map as it is looked at.
#[derive(Clone)]
pub struct Looked {
    /// As it was measured.
    pub whole: Arc<HeightMap>,
    /// Through the filters.
    pub map: Arc<HeightMap>,
    /// What they do.
    pub filtered: Filtered,
}

/// The map that was asked for last stays in memory.
#[derive(Default)]
pub struct Maps(Mutex<Option<(PathBuf, Looked)>>);

fn kept(scan: &Path) -> PathBuf {
    scan.with_file_name(KEPT)
}

fn through(whole: Arc<HeightMap>, filters: Filters) -> Result<Looked> {
    if filters.filters.is_empty() {
        let left = whole.z.iter().filter(|z| z.is_finite()).count();
        let filtered = Filtered { filters: vec![], cells: vec![], left };
        return Ok(Looked { map: whole.clone(), whole, filtered });
    }
    let mut map = (*whole).clone();
    let cells = filter_map(&mut map, &filters.filters.iter().map(|f| (*f).into()).collect::<Vec<_>>())?;
    let left = map.z.iter().filter(|z| z.is_finite()).count();
    Ok(Looked { whole, map: Arc::new(map), filtered: Filtered { filters: filters.filters, cells, left } })
}

impl Maps {
    /// The map of a scan folder through its filters.
    pub fn look(&self, scan: &Path) -> Result<Looked> {
        if let Some((path, looked)) = &*self.0.lock().unwrap_or_else(|e| e.into_inner())
            && path == scan
        {
            return Ok(looked.clone());
        }
        // Ends what a stopped process has begun in it, before files are read.
        load_report(scan)?;
        let text = crate::files::read_text_if_there(&kept(scan))?;
        // Filters of another version are none: the scan is shown as it was measured.
        let filters = text.and_then(|t| serde_json::from_str(&t).ok()).unwrap_or_default();
        let looked = through(Arc::new(HeightMap::load(scan)?), filters)?;
        *self.0.lock().unwrap_or_else(|e| e.into_inner()) = Some((scan.to_owned(), looked.clone()));
        Ok(looked)
    }

    /// Looks through other filters from now on.
    ///
    /// # Errors
    /// Filters whose numbers mean nothing, or that leave nothing; the disk.
    pub fn set(&self, scan: &Path, filters: Filters) -> Result<Filtered> {
        let looked = through(self.look(scan)?.whole, filters)?;
        if looked.filtered.left == 0 {
            return Err(Fault::refused("no cell is left")
                .cause("the last filter takes everything away")
                .next("choose another value; the previous filters stay"));
        }
        let text = serde_json::to_string_pretty(&Filters { filters: looked.filtered.filters.clone() });
        crate::files::write(&kept(scan), text.expect("plain data").as_bytes())?;
        *self.0.lock().unwrap_or_else(|e| e.into_inner()) = Some((scan.to_owned(), looked.clone()));
        Ok(looked.filtered)
    }
}
