//! In: the TOML file that SHEETLIGHT_GENTL names. Out: the devices that it lists, checked.
//! Frame and unit: mm; paths are relative to the file's folder.

use serde::Deserialize;
use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::{Base, Grid, Rigid};
use sheetlight::scan::Where;
use std::path::{Path, PathBuf};

/// The variable that names the file.
pub const VARIABLE: &str = "SHEETLIGHT_GENTL";
/// Most devices of a file.
const MOST_DEVICES: usize = 64;
/// Most cells of a map: with all components 256 MB.
const MOST_CELLS: u64 = 1 << 24;

/// The file.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    device: Vec<Device>,
}

/// One `[[device]]`: `scan`, `recording` with `station`, `simulated` or `folder` says where its frames come from.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Device {
    /// Identifier and serial number: 1 to 64 letters, digits, `-` and `_`.
    pub id: String,
    /// A name for people; the identifier without it.
    pub name: Option<String>,
    /// The folder of a finished scan: its map is every frame.
    pub scan: Option<PathBuf>,
    /// A recording, scanned for every frame ...
    pub recording: Option<PathBuf>,
    /// ... with this station.
    pub station: Option<PathBuf>,
    /// A simulated board, recorded and scanned for every frame.
    pub simulated: Option<Simulated>,
    /// A folder with scans or jobs: each scan that is finished later is a frame.
    pub folder: Option<PathBuf>,
    /// Where recordings are scanned: auto, gpu or cpu.
    #[serde(default = "auto")]
    pub on: String,
    /// The cells of every frame; a finished scan has its own.
    pub grid: Option<GridSpec>,
}

fn auto() -> String {
    "auto".into()
}

/// What is simulated; frame n has the seed `seed + n`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Simulated {
    /// Seed of the first frame's specimen, placement and noise.
    pub seed: u64,
    /// Columns of the sensor, px; it has three quarters as many rows.
    pub width: u32,
    /// Shots of a scan.
    pub shots: usize,
}

/// Cells of a frame. They are stated, because programs ask for the size of a frame before anything was scanned.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GridSpec {
    /// Edge of a cell, mm, 0.0001..=500.
    pub cell_mm: f64,
    /// Columns and rows.
    pub cells: [u32; 2],
    /// Lowest and highest height above the grid's plane, mm: the range of Coord3D_C16.
    pub heights_mm: [f64; 2],
    /// Pose of the grid in the cloud's frame, 16 numbers row by row; the best plane of each scan without it.
    pub base_from_grid: Option<Rigid<Base, Grid>>,
}

/// Where frames come from.
#[derive(Clone, Debug)]
pub enum Origin {
    Scan(PathBuf),
    Recording { recording: PathBuf, station: PathBuf, on: Where, grid: GridSpec },
    Simulated { made: Simulated, on: Where, grid: GridSpec },
    Folder { folder: PathBuf, grid: GridSpec },
}

impl GridSpec {
    fn check(&self) -> Result<()> {
        let bad = |what: String| Err(Fault::input(what).next("correct grid"));
        let [w, h] = self.cells.map(u64::from);
        if !(1e-4..=500.0).contains(&self.cell_mm) {
            return bad(format!("grid.cell_mm is {}, allowed 0.0001..=500", self.cell_mm));
        }
        if w * h == 0 || w * h > MOST_CELLS {
            return bad(format!("grid.cells are {w} x {h}, allowed 1 to {MOST_CELLS} cells"));
        }
        let [low, high] = self.heights_mm;
        if !(low >= -1e5 && high <= 1e5 && high - low >= 1e-3) {
            return bad(format!("grid.heights_mm are {low} and {high}: low, then high, within 100000 mm"));
        }
        Ok(())
    }
}

impl Device {
    /// The one origin that the entry states.
    pub fn origin(&self) -> Result<Origin> {
        let grid = || {
            let grid = self.grid.clone().ok_or_else(|| {
                Fault::input("grid is missing: a program asks for the size of a frame before anything is scanned")
                    .next("add grid = { cell_mm = 0.5, cells = [200, 150], heights_mm = [-5, 30] } with your numbers")
            })?;
            grid.check().map(|()| grid)
        };
        let on: Where = self.on.parse().map_err(|e: String| Fault::input(e).next("correct on"))?;
        match (&self.scan, (&self.recording, &self.station), &self.simulated, &self.folder) {
            (Some(scan), (None, None), None, None) if self.grid.is_none() => Ok(Origin::Scan(scan.clone())),
            (Some(_), (None, None), None, None) => Err(Fault::input("grid stands beside scan")
                .cause("a finished scan has its own cells")
                .next("take grid out, or scan the recording with it")),
            (None, (Some(recording), Some(station)), None, None) => {
                Ok(Origin::Recording { recording: recording.clone(), station: station.clone(), on, grid: grid()? })
            }
            (None, (None, None), Some(made), None) => Ok(Origin::Simulated { made: made.clone(), on, grid: grid()? }),
            (None, (None, None), None, Some(folder)) => Ok(Origin::Folder { folder: folder.clone(), grid: grid()? }),
            _ => Err(Fault::input("it is not clear where the frames come from")
                .next("give one of: scan; recording and station; simulated; folder")),
        }
    }
}

/// A device, or why it cannot be used: listed without access, so that the reason is seen.
pub type Entry = (Device, Result<Origin>);

/// Reads the devices of a text; paths are taken from `base` on.
pub fn parse(text: &str, base: &Path) -> Result<Vec<Entry>> {
    let file: File = toml::from_str(text).map_err(|e| {
        Fault::input(format!("is not a list of devices: {e}"))
            .cause("a misspelt key, or a missing one")
            .next("compare it with docs/connections.md, 3-D camera for GenICam programs")
    })?;
    if !(1..=MOST_DEVICES).contains(&file.device.len()) {
        return Err(Fault::input(format!("lists {} devices, allowed 1..={MOST_DEVICES}", file.device.len()))
            .next("add a [[device]]"));
    }
    let mut seen = std::collections::BTreeSet::new();
    let mut entries = Vec::new();
    for mut device in file.device {
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if !(1..=64).contains(&device.id.len()) || !device.id.chars().all(plain) {
            return Err(Fault::input(format!("the id '{}' is not 1 to 64 letters, digits, - and _", device.id))
                .next("give the device another id"));
        }
        if !seen.insert(device.id.clone()) {
            return Err(Fault::input(format!("the id '{}' is given twice", device.id)).next("give one another id"));
        }
        for path in [&mut device.scan, &mut device.recording, &mut device.station, &mut device.folder] {
            *path = path.take().map(|p| base.join(p));
        }
        let origin = device.origin().map_err(|e| e.at(format!("device {}", device.id)));
        entries.push((device, origin));
    }
    Ok(entries)
}

/// The device that stands for a list that cannot be read.
fn unreadable(fault: Fault) -> Vec<Entry> {
    let device = Device {
        id: "unreadable".into(),
        name: Some(format!("Sheetlight: {}", fault.what)),
        scan: None,
        recording: None,
        station: None,
        simulated: None,
        folder: None,
        on: auto(),
        grid: None,
    };
    vec![(device, Err(fault))]
}

/// The devices of the file that the variable names.
pub fn load() -> Vec<Entry> {
    let Some(path) = std::env::var_os(VARIABLE).filter(|p| !p.is_empty()).map(PathBuf::from) else {
        return unreadable(
            Fault::usage(format!("{VARIABLE} is not set")).next("name the file with the list of devices in it"),
        );
    };
    let base = path.parent().unwrap_or(Path::new("")).to_owned();
    let text = sheetlight::files::read_text(&path);
    text.and_then(|t| parse(&t, &base).map_err(|e| e.at(path.display()))).unwrap_or_else(unreadable)
}

impl Device {
    /// The model's name: where the frames come from.
    pub fn model(&self) -> &'static str {
        match (&self.scan, &self.recording, &self.simulated, &self.folder) {
            (Some(_), ..) => "Finished scan",
            (_, Some(_), ..) => "Recording",
            (_, _, Some(_), _) => "Simulated station",
            (_, _, _, Some(_)) => "Folder of scans",
            _ => "Unreadable",
        }
    }

    pub fn shown_name(&self) -> &str {
        self.name.as_deref().unwrap_or(&self.id)
    }
}
