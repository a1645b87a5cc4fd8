//! In: a part's recipe, and how to insert it. Out: the job with a station's robot.
//! Frame and unit: mm, mm/s, degrees.

use super::word;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sheetlight::robot::Convention;
use sheetlight::scan::Where;
use sheetlight::station::Settings;
use sheetlight::station::job::JobOptions;
use std::path::{Path, PathBuf};
use ts_rs::TS;

/// Largest angle between the touched board and the found part if the order states none, degrees.
const MAX_TILT_DEG: f64 = 3.0;

/// An insertion.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
#[ts(optional_fields = nullable)]
pub struct InsertOrder {
    /// Recipe (TOML) of the part; over HTTP its name
    #[arg(long)]
    pub recipe: String,
    /// Sweep length centred on the picture, mm [default: the part and an eighth of the field's short side at both
    /// ends]
    #[arg(long = "sweep", value_name = "MM")]
    #[serde(default)]
    pub sweep_mm: Option<f64>,
    /// Speed of every motion, mm/s [default: the station's]
    #[arg(skip)]
    #[serde(default)]
    pub speed_mm_s: Option<f64>,
    /// Notation in which poses are shown [default: the station's, else denso]
    #[arg(long, value_parser = word::parse::<Convention>)]
    #[serde(default)]
    #[schemars(schema_with = "word::schema::<Convention>")]
    #[ts(as = "Option<String>")]
    pub notation: Option<Convention>,
    /// Where the stages run: auto (a hardware GPU, else the processor), gpu or cpu
    #[arg(long, default_value = "auto", value_parser = word::parse::<Where>)]
    #[serde(default, with = "word")]
    #[schemars(schema_with = "word::schema::<Where>")]
    #[ts(as = "Option<String>")]
    pub on: Where,
    /// Largest angle between the touched board and the found part, degrees [default: 3]
    #[arg(long, value_name = "DEG")]
    #[serde(default)]
    pub max_tilt_deg: Option<f64>,
    /// After an interruption, retract instead of continuing
    #[arg(skip)]
    #[serde(default)]
    pub back_out: bool,
}

impl InsertOrder {
    /// The options of its job in the folder `out`; `recipe` is the recipe's file.
    pub fn options(&self, station: &Path, settings: &Settings, recipe: PathBuf, out: PathBuf) -> JobOptions {
        JobOptions {
            station: station.to_owned(),
            recipe,
            out,
            robot: self.notation.or(settings.robot).unwrap_or(Convention::Denso),
            place: self.on,
            speed_mm_s: self.speed_mm_s,
            sweep_mm: self.sweep_mm,
            max_tilt_deg: self.max_tilt_deg.unwrap_or(MAX_TILT_DEG),
        }
    }
}
