//! In: nothing. Out: the path of the laser line over a part before it is scanned, and matching values of speed,
//! step and frame rate.
//! Frame and unit: the board as a square-on camera sees it, from the foot of the camera's axis (x right, y down),
//! mm; mm/s; frame rates in Hz.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sheetlight::robot::Convention;
use sheetlight::station::job::{Pace as Paced, Preview};
use ts_rs::TS;

/// The sweep to plan; omitted values are the station's.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SweepAsk {
    /// Name of the recipe.
    pub recipe: String,
    /// Name of an insertion job that has already touched the board.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub job: Option<String>,
    /// Distance from the camera to the board, mm, before it was touched.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub distance_mm: Option<f64>,
    /// Length of the sweep, mm.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub sweep_mm: Option<f64>,
    /// Distance between shots, mm.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub step_mm: Option<f64>,
    /// Speed, mm/s; null: the highest that camera, chain and station allow.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub speed_mm_s: Option<f64>,
    /// Frame rate of another camera than the connected one, Hz.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub camera_hz: Option<f64>,
}

/// The sweep that a job would make.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct SweepPlan {
    /// Name of the recipe.
    pub recipe: String,
    /// True: the board was touched; false: it is assumed to be square to the camera.
    pub touched: bool,
    /// Distance from the board to the camera, mm.
    pub depth_mm: f64,
    /// Distance from the first shot's stripe to the last one's, mm.
    pub length_mm: f64,
    /// Distance between shots, mm.
    pub step_mm: f64,
    /// Number of pictures.
    pub shots: usize,
    /// Size of the part in any rotation: the diagonal of its drawing, mm.
    pub part_mm: f64,
    /// The camera's field of view on the board: x0 y0 x1 y1, mm.
    pub field_mm: [f64; 4],
    /// The corners of the swept area in order: the ends of the first shot's stripe, then of the last one's, mm.
    pub swept_mm: [[f64; 2]; 4],
    /// Largest offset of the part from the picture's middle along the sweep, mm; negative: it is never swept
    /// completely.
    pub along_mm: f64,
    /// The same across the sweep, along the stripe.
    pub across_mm: f64,
    /// Reserve of the working volume above and below the board, mm; null: unknown.
    pub volume_mm: Option<[f64; 2]>,
    /// Distance of the flange from the sides of its box, mm; negative: outside; null: no box is stated, or the
    /// robot's pose is unknown.
    pub box_mm: Option<f64>,
    /// Labels of a flange pose's numbers.
    pub labels: Vec<String>,
    /// Poses of the flange at the first and the last shot; empty if the robot's pose is unknown.
    pub flange: Vec<Vec<f64>>,
    /// The swept area, and the extent of a part in its middle, in the camera's present picture, px; empty: unknown.
    pub seen_px: Vec<Vec<[f64; 2]>>,
    /// Frame rate of the camera, Hz; null: unknown.
    pub camera_hz: Option<f64>,
    /// Rate at which a scan of this station measured pictures of this size, Hz; null: no scan did.
    pub chain_hz: Option<f64>,
    /// The station's speed limit, mm/s.
    pub limit_mm_s: Option<f64>,
    /// Pace of a scan that does not stop for its pictures; null: no limit is known.
    pub pace: Option<Pace>,
}

/// Matching values of speed, step and frame rate.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct Pace {
    /// mm/s.
    pub speed_mm_s: f64,
    /// Distance between shots, mm.
    pub step_mm: f64,
    /// Frame rate, Hz.
    pub rate_hz: f64,
    /// Duration over the whole length, s.
    pub seconds: f64,
    /// camera, chain or speed: the limiting one; null: none is known.
    pub limited_by: Option<String>,
    /// The highest speed that each of them allows at this step, mm/s.
    pub bears: Vec<(String, f64)>,
    /// The step that results at this speed, mm.
    pub left_step_mm: f64,
}

impl From<Paced> for Pace {
    fn from(p: Paced) -> Pace {
        Pace {
            speed_mm_s: p.speed_mm_s,
            step_mm: p.step_mm,
            rate_hz: p.rate_hz,
            seconds: p.seconds,
            limited_by: p.limited_by.map(str::to_owned),
            bears: p.bears.into_iter().map(|(name, v)| (name.to_owned(), v)).collect(),
            left_step_mm: p.left_step_mm,
        }
    }
}

impl SweepPlan {
    /// The message that a page shows; poses in the robot's convention.
    pub fn of(p: Preview, robot: Convention) -> SweepPlan {
        let f = p.sweep;
        SweepPlan {
            recipe: p.recipe,
            touched: p.touched,
            depth_mm: f.depth_mm,
            length_mm: f.length_mm,
            step_mm: f.step_mm,
            shots: f.shots,
            part_mm: f.part_mm,
            field_mm: f.field_mm,
            swept_mm: f.swept_mm,
            along_mm: f.along_mm,
            across_mm: f.across_mm,
            volume_mm: f.volume_mm,
            box_mm: f.box_mm.filter(|_| p.flange.is_some()),
            labels: robot.labels().iter().map(|l| (*l).to_owned()).collect(),
            flange: p.flange.iter().flatten().map(|pose| robot.write(pose)).collect(),
            seen_px: p.seen_px,
            camera_hz: p.can.camera_hz,
            chain_hz: p.can.chain_hz,
            limit_mm_s: p.can.speed_mm_s,
            pace: p.pace.map(Pace::from),
        }
    }
}
