//! In: a recording and settings. Out: what a scan of it needs.
//! Frame and unit: pixels, mm.

use super::at::At;
use super::word;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sheetlight::capture::Latency;
use sheetlight::fault::{Fault, Result};
use sheetlight::raster::{Channel, Image};
use sheetlight::recording::Recording;
use sheetlight::rig::Rig;
use sheetlight::scan::{GridOptions, Where};
use sheetlight::station::{ScanOptions, Settings, changed};
use std::collections::BTreeMap;
use std::path::Path;
use ts_rs::TS;

/// The recording to scan, and the settings.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
#[ts(optional_fields = nullable)]
pub struct ScanOrder {
    /// Recording folder with meta.json
    #[arg(default_value = "", hide_default_value = true, conflicts_with = "camera")]
    pub recording: String,
    /// Pose file of the recording, without extension [default: the one in meta.json]
    #[arg(long)]
    pub poses: Option<String>,
    /// Channel of a colour picture: red, green, blue or luma
    #[arg(long, default_value = "luma", value_parser = word::parse::<Channel>)]
    #[serde(default, with = "word")]
    #[schemars(schema_with = "word::schema::<Channel>")]
    #[ts(as = "Option<String>")]
    pub channel: Channel,
    /// Picture with the laser off at the shots' exposure, to subtract: in the recording, or a path; once per exposure
    #[arg(long)]
    #[serde(default)]
    #[ts(optional, as = "Option<Vec<String>>")]
    pub ambient: Vec<String>,
    /// Use exposure N of a recording with several, 1 is the shortest, instead of merging all
    #[arg(long, value_name = "N", hide_short_help = true, conflicts_with_all = ["camera", "raw"])]
    pub exposure: Option<usize>,
    /// Where the stages run: auto (a hardware GPU, else the processor), gpu or cpu
    #[arg(long, default_value = "auto", value_parser = word::parse::<Where>)]
    #[serde(default, with = "word")]
    #[schemars(schema_with = "word::schema::<Where>")]
    #[ts(as = "Option<String>")]
    pub on: Where,
    /// Cell of the height map, mm [default: about 1.5 points per cell]
    #[arg(long, value_name = "MM")]
    pub cell_mm: Option<f64>,
    /// Exclude shots that cannot be read, and list them
    #[arg(long)]
    #[serde(default)]
    pub skip_bad: bool,
    /// Settings that differ from the station's: dotted keys of the section extraction in station.toml, and their values
    #[arg(skip)]
    #[serde(default)]
    #[ts(type = "Record<string, unknown>")]
    pub settings: BTreeMap<String, serde_json::Value>,
}

impl ScanOrder {
    /// The options of its scan into `out`.
    ///
    /// # Errors
    /// A setting that does not exist or is out of range; a delay that cannot be read.
    pub fn options(&self, at: &At, settings: &Settings, rig: &Rig, out: &Path) -> Result<ScanOptions> {
        let settings = changed(settings, "extraction", &self.settings)?;
        Ok(ScanOptions {
            place: self.on,
            grid: GridOptions { cell: self.cell_mm, ..GridOptions::default() },
            skip_bad: self.skip_bad,
            latency: Latency::load(at.station)?,
            ..ScanOptions::for_station(&settings, rig, out)
        })
    }

    /// Opens the recording.
    ///
    /// # Errors
    /// It cannot be read, or does not have what the order selects.
    pub fn open(&self, at: &At) -> Result<Recording> {
        let mut recording = at.recording(&self.recording)?;
        recording.channel = self.channel;
        at.check(&recording, self.poses.as_deref())?;
        if recording.meta.motion().axis().is_none() {
            at.doubts(recording.pose_file(self.poses.as_deref())?.warnings);
        } else if self.poses.is_some() {
            return Err(Fault::usage("poses are named, and meta.json says that an axis moved")
                .cause("another recording, or a motion that is not this one's")
                .next("name no poses, or correct 'motion' in meta.json"));
        }
        self.exposure.map(|n| recording.use_exposure(n)).transpose()?;
        Ok(recording)
    }

    /// The picture to subtract from the shots of a recording.
    ///
    /// # Errors
    /// It cannot be read, or does not fit the shots.
    pub fn dark(&self, at: &At, recording: &Recording) -> Result<Option<Image>> {
        let load = |name: &String| {
            let inside = recording.inside(name).ok().filter(|path| path.is_file());
            let path = inside.map_or_else(|| at.names.path(name), Ok)?;
            recording.load(&path).map_err(no_ambient)
        };
        recording.dark(self.ambient.iter().map(load).collect::<Result<_>>()?)
    }
}

/// A fault of the picture with the laser off.
pub(crate) fn no_ambient(fault: Fault) -> Fault {
    fault
        .at("the ambient picture")
        .cause("a picture of another camera or another setting, or no picture")
        .next("take one picture with the laser off and nothing else changed")
}
