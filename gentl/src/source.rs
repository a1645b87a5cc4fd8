//! In: where a device's frames come from. Out: the frames, one after the other: a map, and of a finished scan its
//! points.
//! Frame and unit: mm; points in the cloud's frame, heights above the grid's plane.

use crate::config::{GridSpec, Origin, Simulated};
use sheetlight::capture::Latency;
use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::{Base, Grid, Rigid, Vec3};
use sheetlight::recording::Recording;
use sheetlight::rig::Rig;
use sheetlight::scan::{CloudPoint, GridOptions, HeightMap, RecordingSource, Where, grid, read_cloud};
use sheetlight::simulate::{SimulateOptions, simulate};
use sheetlight::station::{HeldScan, ScanOptions, Settings, load_report, scan_held, whole_scan};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// What was measured: one frame before it is put into a buffer.
pub struct Taken {
    pub map: HeightMap,
    /// The points of a finished scan; empty for the others, whose number differs from frame to frame.
    pub points: Vec<CloudPoint>,
    /// The frame that the points are in: base, axis, flange or map.
    pub frame: String,
    /// Bits of a grey level of the intensity, 8 to 16.
    pub bits: u8,
}

/// What all frames of a device have in common.
#[derive(Clone, Debug)]
pub struct Layout {
    pub width: u32,
    pub height: u32,
    /// Points of a cloud; 0 if no clouds are given.
    pub points: u32,
    pub cell_mm: f64,
    /// Height of value 1 of Coord3D_C16, mm, and height between two values.
    pub low_mm: f64,
    pub step_mm: f64,
    /// Pose of the grid, if it is the same in all frames.
    pub base_from_grid: Option<Rigid<Base, Grid>>,
    /// The frame of coordinates, if it is known before the first frame.
    pub frame: String,
}

impl Layout {
    fn of(grid: &GridSpec, frame: &str) -> Layout {
        let ([width, height], [low, high]) = (grid.cells, grid.heights_mm);
        // Value 1 is the lowest height, 65535 the highest, as in height.png; 0 is missing.
        let step_mm = (high - low) / 65_534.0;
        let (cell_mm, base_from_grid) = (grid.cell_mm, grid.base_from_grid);
        let frame = frame.to_owned();
        Layout { width, height, points: 0, cell_mm, low_mm: low, step_mm, base_from_grid, frame }
    }

    /// The value of Coord3D_C16; 0 where nothing was measured or the height is out of range.
    pub fn c16(&self, z: f32) -> u16 {
        let steps = ((f64::from(z) - self.low_mm) / self.step_mm).round();
        if (0.0..=65_534.0).contains(&steps) { steps as u16 + 1 } else { 0 }
    }
}

/// Where a device's next frame comes from.
pub enum Source {
    /// Every frame is this one.
    Scan(Arc<Taken>),
    Recording {
        recording: Box<Recording>,
        rig: Box<Rig>,
        settings: Box<Settings>,
        latency: Option<Latency>,
        on: Where,
        grid: GridSpec,
    },
    Simulated {
        made: Simulated,
        next: u64,
        on: Where,
        grid: GridSpec,
    },
    Folder {
        folder: PathBuf,
        seen: BTreeSet<(PathBuf, String)>,
        grid: GridSpec,
    },
}

impl Source {
    /// Opens what the device needs for its frames, so that a folder that cannot be used is refused at once.
    pub fn open(origin: &Origin) -> Result<(Source, Layout)> {
        match origin {
            Origin::Scan(scan) => {
                let taken = finished(scan)?;
                let (scale, map) = (taken.map.to_u16().0, &taken.map);
                let layout = Layout {
                    width: map.width,
                    height: map.height,
                    points: u32::try_from(taken.points.len()).unwrap_or(0),
                    cell_mm: map.cell,
                    low_mm: scale.png_offset_mm,
                    step_mm: scale.png_step_mm,
                    base_from_grid: Some(map.base_from_grid),
                    frame: taken.frame.clone(),
                };
                Ok((Source::Scan(Arc::new(taken)), layout))
            }
            Origin::Recording { recording, station, on, grid } => {
                let recording = Recording::open(recording)?;
                let layout = Layout::of(grid, recording.meta.motion().frame());
                let source = Source::Recording {
                    recording: Box::new(recording),
                    rig: Box::new(Rig::load(station)?),
                    settings: Box::new(Settings::load(station)?),
                    latency: Latency::load(station)?,
                    on: *on,
                    grid: grid.clone(),
                };
                Ok((source, layout))
            }
            Origin::Simulated { made, on, grid } => {
                options(made, 0).check()?;
                let source = Source::Simulated { made: made.clone(), next: 0, on: *on, grid: grid.clone() };
                Ok((source, Layout::of(grid, "base")))
            }
            Origin::Folder { folder, grid } => {
                let seen = scans_in(folder)?;
                let source = Source::Folder { folder: folder.clone(), seen, grid: grid.clone() };
                Ok((source, Layout::of(grid, "")))
            }
        }
    }

    /// Whether frames come when a scan is finished elsewhere, not when a program asks for them.
    pub fn is_external(&self) -> bool {
        matches!(self, Source::Folder { .. })
    }

    /// Begins an acquisition. Scans that were finished before it do not become frames.
    pub fn begin(&mut self) -> Result<()> {
        if let Source::Folder { folder, seen, .. } = self {
            *seen = scans_in(folder)?;
        }
        Ok(())
    }

    /// The next frame; `None` if no scan was finished since the last one.
    pub fn next(&mut self, stop: &Arc<AtomicBool>) -> Result<Option<Arc<Taken>>> {
        match self {
            Source::Scan(taken) => Ok(Some(taken.clone())),
            Source::Recording { recording, rig, settings, latency, on, grid } => {
                scanned(recording, rig, settings, latency.as_ref(), (*on, grid), stop).map(Some)
            }
            Source::Simulated { made, next, on, grid } => {
                let folder = tempfile::tempdir().map_err(|e| Fault::write(&std::env::temp_dir(), e))?;
                let made = simulate(folder.path(), &options(made, *next), &|_, _| {})?;
                let (_, recording, _) =
                    made.recordings.first().ok_or_else(|| Fault::output("nothing was simulated"))?;
                let (rig, settings) = (Rig::load(&made.station)?, Settings::default());
                let taken = scanned(&Recording::open(recording)?, &rig, &settings, None, (*on, grid), stop)?;
                *next += 1;
                Ok(Some(taken))
            }
            Source::Folder { folder, seen, grid } => {
                let Some(new) = scans_in(folder)?.into_iter().find(|scan| !seen.contains(scan)) else {
                    return Ok(None);
                };
                // Also one that cannot be read is not met again.
                seen.insert(new.clone());
                in_cells(&new.0, grid).map(|taken| Some(Arc::new(taken)))
            }
        }
    }
}

/// What is simulated for frame `n`.
pub fn options(made: &Simulated, n: u64) -> SimulateOptions {
    SimulateOptions {
        seed: made.seed.wrapping_add(n),
        width: made.width,
        height: made.width / 4 * 3,
        shots: made.shots,
        ..SimulateOptions::default()
    }
}

fn finished(scan: &Path) -> Result<Taken> {
    let (report, _, _) = whole_scan(scan)?;
    let (map, points) = (HeightMap::load(scan)?, read_cloud(&scan.join("cloud.ply"))?);
    Ok(Taken { map, points, frame: report.frame, bits: report.image.bits })
}

/// A finished scan's points in a device's cells.
fn in_cells(scan: &Path, cells: &GridSpec) -> Result<Taken> {
    let of_scan = finished(scan)?;
    let up = of_scan.map.base_from_grid.direction(&Vec3::z());
    let map = grid(&of_scan.points, &GridOptions { up, ..grid_options(cells) })?;
    Ok(Taken { map, points: Vec::new(), ..of_scan })
}

fn grid_options(cells: &GridSpec) -> GridOptions {
    GridOptions {
        cell: Some(cells.cell_mm),
        cells: Some(cells.cells),
        base_from_grid: cells.base_from_grid,
        ..GridOptions::default()
    }
}

fn scanned(
    recording: &Recording,
    rig: &Rig,
    settings: &Settings,
    latency: Option<&Latency>,
    (place, cells): (Where, &GridSpec),
    stop: &Arc<AtomicBool>,
) -> Result<Arc<Taken>> {
    let options = ScanOptions {
        place,
        grid: grid_options(cells),
        motion: recording.meta.motion(),
        stop: stop.clone(),
        ..ScanOptions::for_station(settings, rig, Path::new(""))
    };
    let mut source = RecordingSource::late(recording, None, 0, latency)?;
    let label = recording.folder.display().to_string();
    let HeldScan { report, map, points, .. } = scan_held(&label, &mut source, rig, &options, |_, _| {})?;
    let map = map.ok_or_else(|| {
        Fault::refused(format!("{label}: {} points are too few for a map", points.len()))
            .cause("no laser was found in the shots")
            .next("scan it with the command line and look at its page")
    })?;
    Ok(Arc::new(Taken { map, points: Vec::new(), frame: report.frame, bits: report.image.bits }))
}

/// The finished scans in a folder, in its folders, and in the `scan` folders of those (jobs), each with the moment at
/// which it was made: a job that scans again replaces its scan.
fn scans_in(folder: &Path) -> Result<BTreeSet<(PathBuf, String)>> {
    let entries = std::fs::read_dir(folder).map_err(|e| Fault::read(folder, e))?;
    let mut scans = BTreeSet::new();
    for entry in entries {
        let path = entry.map_err(|e| Fault::read(folder, e))?.path();
        for scan in [path.join("scan"), path] {
            // scan.json comes last: without it the rest is not a scan.
            if scan.join("scan.json").is_file()
                && let Ok(report) = load_report(&scan)
            {
                scans.insert((scan, report.created));
            }
        }
    }
    Ok(scans)
}
