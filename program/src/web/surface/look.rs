//! In: a scan's folder, the filters for viewing it. Out: its filtered map. The filters are stored beside the scan,
//! so that a reloaded page, a second tab and a restarted program show the same.
//! Frame and unit: the height map's grid frame, mm.

use crate::web::message::{Filtered, Filters};
use sheetlight::fault::{Fault, Result};
use sheetlight::scan::HeightMap;
use sheetlight::station::{filter_map, load_report};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// Name of the filters' file in the job's folder, beside the scan.
const KEPT: &str = "filters.json";

/// A map and its filtered version.
#[derive(Clone)]
pub struct Looked {
    /// The map as measured.
    pub whole: Arc<HeightMap>,
    /// The filtered map.
    pub map: Arc<HeightMap>,
    /// Effect of the filters.
    pub filtered: Filtered,
}

/// Caches the map that was requested last.
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
    /// The map of a scan folder with its filters applied.
    pub fn look(&self, scan: &Path) -> Result<Looked> {
        if let Some((path, looked)) = &*self.0.lock().unwrap_or_else(|e| e.into_inner())
            && path == scan
        {
            return Ok(looked.clone());
        }
        // Ends what a stopped process has begun in the folder, before files are read.
        load_report(scan)?;
        let text = sheetlight::files::read_text_if_there(&kept(scan))?;
        // Filters of another version are ignored: the scan is shown as measured.
        let filters = text.and_then(|t| serde_json::from_str(&t).ok()).unwrap_or_default();
        let looked = through(Arc::new(HeightMap::load(scan)?), filters)?;
        *self.0.lock().unwrap_or_else(|e| e.into_inner()) = Some((scan.to_owned(), looked.clone()));
        Ok(looked)
    }

    /// Sets other filters from now on.
    ///
    /// # Errors
    /// Invalid numbers in filters, filters that leave no cell, a file that cannot be written.
    pub fn set(&self, scan: &Path, filters: Filters) -> Result<Filtered> {
        let looked = through(self.look(scan)?.whole, filters)?;
        if looked.filtered.left == 0 {
            return Err(Fault::refused("no cell is left")
                .cause("the last filter takes everything away")
                .next("choose another value; the previous filters stay"));
        }
        let text = serde_json::to_string_pretty(&Filters { filters: looked.filtered.filters.clone() });
        sheetlight::files::write(&kept(scan), text.expect("plain data").as_bytes())?;
        *self.0.lock().unwrap_or_else(|e| e.into_inner()) = Some((scan.to_owned(), looked.clone()));
        Ok(looked.filtered)
    }
}
