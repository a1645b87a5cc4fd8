//! In: finished scans of a part, its recipe. Out: the part's pose and the tool's, or which gates failed.
//! Frame and unit: the scan's frame; mm, degrees.

use super::at::Names;
use super::pins::between_pins;
use super::word;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sheetlight::fault::{Fault, Result};
use sheetlight::find::{Accelerator, LocateOptions, Recipe, Report};
use sheetlight::geometry::Vec3;
use sheetlight::raster::RgbImage;
use sheetlight::recording::Recording;
use sheetlight::robot::Convention;
use sheetlight::station::{Looked, Settings, find_part_in_all, with_scale};
use std::path::{Path, PathBuf};
use ts_rs::TS;

/// What to find, and in which scans.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
#[ts(optional_fields = nullable)]
pub struct FindOrder {
    /// Scans of one part, from one or several sides: folders from sheetlight scan --out; over HTTP names of jobs
    #[arg(required = true)]
    pub scans: Vec<String>,
    /// Recording of the pointer's spot on plain surfaces of the part, with robot poses; checks the height
    #[arg(long, value_name = "RECORDING")]
    #[serde(default)]
    pub range: Option<String>,
    /// Recipe (TOML) of the part; over HTTP its name
    #[arg(long)]
    pub recipe: String,
    /// Notation of the poses: denso, ur, kuka, ... (docs/conventions.md) [default: the station's, else matrix]
    #[arg(long, value_parser = word::parse::<Convention>)]
    #[serde(default)]
    #[schemars(schema_with = "word::schema::<Convention>")]
    #[ts(as = "Option<String>")]
    pub robot: Option<Convention>,
    /// Direction towards the camera, base frame [default: from the station, else 0,0,1]
    #[arg(long, value_name = "X,Y,Z", value_parser = word::numbers::<3>, allow_hyphen_values = true)]
    #[serde(default)]
    pub up: Option<[f64; 3]>,
    /// Two places in the first scan's map, mm: the tool goes to the middle of the pins there [default: to the point
    /// that the recipe names]
    #[arg(long, value_name = "X,Y,X,Y", value_parser = two_places)]
    #[serde(default)]
    pub pins: Option<[[f64; 2]; 2]>,
    /// List every match, not only the best
    #[arg(long)]
    #[serde(default)]
    pub all: bool,
}

/// A part that was looked for.
pub struct Located {
    /// Its pose, and the gates.
    pub report: Report,
    /// The recipe that was used: with `pins` not the one that was named.
    pub recipe: Recipe,
    /// The first scan with the part's outline.
    pub picture: RgbImage,
    /// The notation of the poses.
    pub notation: Convention,
}

impl FindOrder {
    /// Finds the part. `station` is that of the scans; without it the error budget lacks the calibrations. With
    /// `patient` a part that is not found is also looked for in other scales, which takes some forty searches.
    ///
    /// # Errors
    /// An input that cannot be read or does not belong to the others; the part is not in a scan.
    pub fn find(&self, names: &dyn Names, station: Option<&Path>, patient: bool) -> Result<Located> {
        let recipe = names.recipe(&self.recipe)?;
        if self.scans.is_empty() {
            return Err(Fault::usage("no scan was chosen").next("choose one, or several scans of the same part"));
        }
        let scans = self.scans.iter().map(|name| names.scan(name)).collect::<Result<Vec<PathBuf>>>()?;
        let range = self.range.as_ref().map(|name| Recording::open(&names.path(name)?)).transpose()?;
        let options = self.options(station)?;
        let looked = Looked { scans: &scans, range: range.as_ref() };
        let find = |recipe: &Recipe| find_part_in_all(&looked, recipe, station, &options);
        let explained = |fault| if patient { with_scale(fault, &scans, &recipe, &options) } else { fault };
        let (report, picture) = find(&recipe).map_err(explained)?;
        let notation = options.robot;
        let Some(places) = &self.pins else { return Ok(Located { report, recipe, picture, notation }) };
        let grid_from_part = report.map.base_from_grid.inverse() * report.base_from_part;
        let recipe = between_pins(&recipe, &grid_from_part, places)?;
        let of = recipe.construction.last().map(|c| c.of.join(", ")).unwrap_or_default();
        let (mut report, picture) = find(&recipe)?;
        report.notes.insert(0, format!("the tool goes where the middle of {of} says"));
        Ok(Located { report, recipe, picture, notation })
    }

    fn options(&self, station: Option<&Path>) -> Result<LocateOptions> {
        let up = self.up.map(Vec3::from);
        // NaN is no direction either.
        if up.is_some_and(|up| !(up.norm() >= 1e-6)) {
            return Err(Fault::usage("the direction towards the camera is 0").next("give three numbers, e.g. 0,0,1"));
        }
        let of_station = station.map(Settings::load).transpose()?.and_then(|s| s.robot);
        let robot = self.robot.or(of_station).unwrap_or(Convention::Matrix);
        Ok(LocateOptions { up, robot, accelerator: Accelerator::open(), expected: None, all: self.all })
    }
}

fn two_places(s: &str) -> std::result::Result<[[f64; 2]; 2], String> {
    word::numbers::<4>(s).map(|[a, b, c, d]| [[a, b], [c, d]])
}
