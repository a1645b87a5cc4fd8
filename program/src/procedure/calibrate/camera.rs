//! In: recordings of boards. Out: camera and lens.
//! Frame and unit: camera frame; pixels, mm.

use super::super::at::{At, Remark};
use super::super::word;
use super::{Calibration, OfBoards, Progress, Solved, open};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sheetlight::calibrate::camera::intrinsics::{Boards, SolveOptions};
use sheetlight::calibrate::camera::lens::Lens;
use sheetlight::calibrate::camera::procedure::{CameraOptions, CameraResult, calibrate};
use sheetlight::calibrate::camera::report::page;
use sheetlight::camera::NAMES;
use sheetlight::fault::Result;
use sheetlight::raster::Channel;
use sheetlight::station::Settings;
use sheetlight::station::volume::asked;
use ts_rs::TS;

/// Inputs of the camera's calibration.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
#[ts(optional_fields = nullable)]
pub struct CameraOrder {
    /// Recording of a board
    pub recording: String,
    /// Further recordings of the same camera, also of other boards
    #[arg(value_name = "RECORDINGS")]
    #[serde(default)]
    pub more: Vec<String>,
    /// Frames that are not used, counted from 0 over all recordings
    #[arg(long, value_name = "N,N,...", value_delimiter = ',')]
    #[serde(default)]
    pub leave_out: Vec<usize>,
    /// Lens terms: evidence (what the pictures determine), none, one (k1), four (k1 k2 p1 p2), five (k3 too),
    /// rational (and k4 k5 k6), prism (five and s1..s4), scheimpflug (k1 k2 k3 and tilt), all (OpenCV's 14)
    #[arg(long, default_value = "evidence", value_parser = word::parse::<Lens>)]
    #[serde(default, with = "word")]
    #[schemars(schema_with = "word::schema::<Lens>")]
    #[ts(as = "Option<String>")]
    pub lens: Lens,
    /// Estimate the skew too; sensors with square rows have none
    #[arg(long)]
    #[serde(default)]
    pub skew: bool,
    /// Shape of the board: evidence (estimated if 8 or more pictures determine it), drawn (as drawn), shaped (always
    /// estimated)
    #[arg(long, default_value = "evidence", value_parser = word::parse::<Boards>)]
    #[serde(default, with = "word")]
    #[schemars(schema_with = "word::schema::<Boards>")]
    #[ts(as = "Option<String>")]
    pub board: Boards,
    /// Distance at which the expected error is judged, mm [default: middle of the working volume, else of the boards]
    #[arg(long, value_name = "MM")]
    pub working_mm: Option<f64>,
    /// Channel of a colour picture: red, green, blue or luma
    #[arg(long, default_value = "luma", value_parser = word::parse::<Channel>)]
    #[serde(default, with = "word")]
    #[schemars(schema_with = "word::schema::<Channel>")]
    #[ts(as = "Option<String>")]
    pub channel: Channel,
}

impl Calibration for CameraOrder {
    fn recording(&self) -> &str {
        &self.recording
    }

    fn suits(_: &OfBoards) -> bool {
        true
    }

    fn solve(&self, at: &At, progress: Progress) -> Result<Solved> {
        let settings = Settings::load(at.station)?;
        let names: Vec<&String> = [&self.recording].into_iter().chain(&self.more).collect();
        let mut recordings = open(at, &names, &self.leave_out)?;
        recordings.iter_mut().for_each(|r| r.channel = self.channel);
        let options = CameraOptions {
            solve: SolveOptions { lens: self.lens, skew: self.skew, boards: self.board, ..SolveOptions::default() },
            asked: asked(&settings, self.working_mm.map(|mm| [mm, mm])),
            ..CameraOptions::default()
        };
        let result = calibrate(&recordings, &options, progress)?;
        if !result.left_out.is_empty() {
            let all = result.left_out.len() + result.used.len();
            (at.remark)(Remark::Doubt(format!(
                "{} of {all} pictures were excluded, with reasons. Compare your scans with the excluded pictures: if \
                 the scans look like these, the calibration is wrong for them",
                result.left_out.len()
            )));
        }
        let page = page(&result, &format!("Camera calibration of {}", settings.name));
        let value = parameters(&result);
        Ok(Solved { record: Box::new(result.calibration), page, value, excluded: result.left_out })
    }
}

/// The parameters with their standard deviations, and the expected error.
fn parameters(result: &CameraResult) -> String {
    let (c, k) = (&result.calibration, result.calibration.value.parameters());
    let mut text = String::from("camera");
    let stated = |name: &str| c.covariance.parameters.iter().any(|p| p == name);
    for (name, value) in NAMES.iter().zip(k.iter()).filter(|(name, _)| stated(name)) {
        text += &format!("\n  {name:9} {value:12.6} +- {:.6}", c.covariance.sigma(name).unwrap_or(f64::NAN));
    }
    let figure = |name: &str| c.quality.figures.get(name).copied().unwrap_or(f64::NAN);
    let px = figure("expected_ray_error_where_seen_px");
    let mm = figure("expected_error_at_working_distance_mm");
    text += &match px.is_finite() && mm.is_finite() {
        true => format!(
            "\nexpected error of the viewing rays where boards were seen {px:.4} px, {mm:.4} mm at {:.0} mm",
            figure("working_distance_mm"),
        ),
        false => "\nexpected error of the viewing rays: unknown, the pictures do not determine all parameters".into(),
    };
    text
}
