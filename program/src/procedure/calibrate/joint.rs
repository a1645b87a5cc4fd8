//! In: recordings of boards. Out: all calibrations of a rig from one solve.
//! Frame and unit: mm, degrees.

use super::super::at::{At, Remark};
use super::super::word;
use super::{Progress, open};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sheetlight::calibrate::hand_eye::options::Mount;
use sheetlight::fault::{Fault, Result};
use sheetlight::raster::Channel;
use sheetlight::rig::Rig;
use sheetlight::scan::Where;
use sheetlight::station::volume::asked;
use sheetlight::station::{JointResult, JointRun, Settings, calibrate_joint, mount_of};
use ts_rs::TS;

/// Inputs of a calibration of the whole rig.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
#[ts(optional_fields = nullable)]
pub struct JointOrder {
    /// Recordings of boards
    #[arg(required = true)]
    pub recordings: Vec<String>,
    /// Pose file of the recordings with robot poses, without extension [default: the one in meta.json]
    #[arg(long)]
    pub poses: Option<String>,
    /// Where the camera is: eye-in-hand (on the flange) or eye-to-hand (fixed) [default: the station's, else
    /// eye-in-hand with a note]
    #[arg(long, value_parser = word::parse::<Mount>)]
    #[schemars(schema_with = "word::schema::<Mount>")]
    #[ts(as = "Option<String>")]
    pub mount: Option<Mount>,
    /// Nearest and farthest depth of the stated error, mm [default: the working volume, else where boards were lit]
    #[arg(long, num_args = 2, value_names = ["NEAR", "FAR"])]
    pub working_mm: Option<Vec<f64>>,
    /// Channel of a colour picture: red, green, blue or luma
    #[arg(long, default_value = "luma", value_parser = word::parse::<Channel>)]
    #[serde(default, with = "word")]
    #[schemars(schema_with = "word::schema::<Channel>")]
    #[ts(as = "Option<String>")]
    pub channel: Channel,
    /// Where the stages run: auto (a hardware GPU, else the processor), gpu or cpu
    #[arg(long, default_value = "auto", value_parser = word::parse::<Where>)]
    #[serde(default, with = "word")]
    #[schemars(schema_with = "word::schema::<Where>")]
    #[ts(as = "Option<String>")]
    pub on: Where,
}

impl JointOrder {
    /// Calibrates; nothing is stored.
    ///
    /// # Errors
    /// An input that cannot be read, or recordings that do not determine the rig.
    pub fn solve(&self, at: &At, progress: Progress) -> Result<JointResult> {
        if self.recordings.is_empty() {
            return Err(Fault::usage("no recording was chosen").next("choose recordings of boards"));
        }
        let (settings, rig) = (Settings::load(at.station)?, Rig::load_camera(at.station)?);
        let mut recordings = open(at, &self.recordings.iter().collect::<Vec<_>>(), &[])?;
        recordings.iter_mut().for_each(|r| r.channel = self.channel);
        recordings.iter().try_for_each(|r| at.check(r, self.poses.as_deref()))?;
        let mounted = mount_of(at.station, &settings, self.mount)?;
        mounted.assumed.into_iter().for_each(|why| (at.remark)(Remark::Assumed(why)));
        let working = match self.working_mm.as_deref() {
            None => None,
            Some([near, far]) => Some([*near, *far]),
            Some(other) => {
                return Err(Fault::usage(format!("working_mm has {} numbers, two are needed", other.len()))
                    .next("state the nearest and the farthest depth, mm"));
            }
        };
        let new = JointRun::new(mounted.mount, asked(&settings, working), &settings.extraction, self.on);
        calibrate_joint(&recordings, &rig, &JointRun { poses: self.poses.clone(), ..new }, progress)
    }
}
