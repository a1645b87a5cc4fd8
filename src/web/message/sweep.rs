//! In: nothing. Out: the way of the line over a part before it is scanned, and which speed, step and pictures a
//! second go together.
//! Frame and unit: the board as the camera sees it squarely, from the foot of its axis (x right, y down), mm; mm/s;
//! pictures a second.

use crate::robot::Convention;
use crate::station::job::{Pace as Paced, Preview};
use serde::{Deserialize, Serialize};
use ts_rs::TS;

/// Which sweep; what is left open is the station's own.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct SweepAsk {
    /// Name of the recipe.
    pub recipe: String,
    /// An insertion that touched the board already.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub job: Option<String>,
    /// From the camera to the board, mm, before it was touched.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub distance_mm: Option<f64>,
    /// Length, mm.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub sweep_mm: Option<f64>,
    /// From one shot to the next, mm.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub step_mm: Option<f64>,
    /// mm/s; without: the fastest that all bear.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub speed_mm_s: Option<f64>,
    /// Pictures a second of another camera than the one that is linked.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub camera_hz: Option<f64>,
}

/// A sweep that a job would make.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct SweepPlan {
    /// Name of the recipe.
    pub recipe: String,
    /// The board was touched; else it is taken to lie squarely before the camera.
    pub touched: bool,
    /// From the board to the camera, mm.
    pub depth_mm: f64,
    /// From the first shot's stripe to the last one's, mm.
    pub length_mm: f64,
    /// From one shot to the next, mm.
    pub step_mm: f64,
    /// Pictures.
    pub shots: usize,
    /// Across the part however it is turned, mm.
    pub part_mm: f64,
    /// What the camera sees of the board: x0 y0 x1 y1, mm.
    pub field_mm: [f64; 4],
    /// Ends of the first shot's stripe, then of the last one's, in the order around what is swept, mm.
    pub swept_mm: [[f64; 2]; 4],
    /// How far the part may lie off the picture's middle along the sweep, mm; negative: it is never swept whole.
    pub along_mm: f64,
    /// The same along the stripe.
    pub across_mm: f64,
    /// Left of the working volume above the board and below it, mm; null: nobody knows it.
    pub volume_mm: Option<[f64; 2]>,
    /// Left to the sides of the flange's box, mm; negative: outside; null: no box is stated or the robot's place is
    /// not known.
    pub box_mm: Option<f64>,
    /// Names of a flange pose's numbers.
    pub labels: Vec<String>,
    /// The flange at the first and the last shot; empty where the robot's place is not known.
    pub flange: Vec<Vec<f64>>,
    /// What is swept, and how far a part in its middle reaches, in the camera's picture as it stands now, px; empty:
    /// not known.
    pub seen_px: Vec<Vec<[f64; 2]>>,
    /// Pictures a second that the camera sends; null: not known.
    pub camera_hz: Option<f64>,
    /// Pictures of this size that a scan of this station measured in a second; null: none did.
    pub chain_hz: Option<f64>,
    /// The station's limit, mm/s.
    pub limit_mm_s: Option<f64>,
    /// Of a scan that does not stop for its pictures; null: nothing is known that limits it.
    pub pace: Option<Pace>,
}

/// Speed, step and pictures a second that go together.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct Pace {
    /// mm/s.
    pub speed_mm_s: f64,
    /// mm a shot.
    pub step_mm: f64,
    /// Pictures a second.
    pub rate_hz: f64,
    /// Over the whole length, s.
    pub seconds: f64,
    /// camera, chain or speed: the one that allows no more; null: none does.
    pub limited_by: Option<String>,
    /// The fastest that each of them bears at this step, mm/s.
    pub bears: Vec<(String, f64)>,
    /// The step that is left at this speed, mm.
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
    /// As a page shows it, poses in the robot's notation.
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
