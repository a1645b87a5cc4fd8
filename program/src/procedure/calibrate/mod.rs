//! In: recordings of boards, ordered by a person or a program. Out: calibrations with their pages. Nothing is stored
//! here.
//! Frame and unit: each record names its frames; mm, degrees.

mod auto;
mod axis;
mod camera;
mod hand_eye;
mod joint;
mod laser_plane;
mod pointer;

pub use auto::AutoOrder;
pub use axis::AxisOrder;
pub use camera::CameraOrder;
pub use hand_eye::HandEyeOrder;
pub use joint::JointOrder;
pub use laser_plane::LaserPlaneOrder;
pub use pointer::PointerOrder;

use super::at::At;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sheetlight::calibrate::report::Page;
use sheetlight::fault::{Fault, Result};
use sheetlight::recording::{Beam, Recording};
use sheetlight::rig::{Measured, Record};
use sheetlight::station::Calibrated;
use strum::VariantArray;
use ts_rs::TS;

/// A calibration that makes one record.
pub trait Calibration {
    /// Name of its recording; empty without one.
    fn recording(&self) -> &str;
    /// Whether a recording of boards suits.
    fn suits(boards: &OfBoards) -> bool
    where
        Self: Sized;
    /// Calibrates; nothing is stored.
    ///
    /// # Errors
    /// An input that cannot be read, or that does not determine the record.
    fn solve(&self, at: &At, progress: Progress) -> Result<Solved>;
}

/// A recording of boards.
#[derive(Clone, Copy, Debug)]
pub struct OfBoards {
    /// The light on them; `None`: room light.
    pub beam: Option<Beam>,
    /// An axis moved, and no robot.
    pub axis: bool,
}

/// Receives the numbers of pictures done and of all.
pub type Progress<'a> = &'a (dyn Fn(usize, usize) + Sync);

/// A calibration that was solved.
pub struct Solved {
    /// The record.
    pub record: Box<dyn Record>,
    /// Its report.
    pub page: Page,
    /// The value in words, for a terminal.
    pub value: String,
    /// Pictures that were not used, with the reason.
    pub excluded: Vec<(String, String)>,
}

impl Solved {
    /// A record of whatever kind with its value in words.
    pub fn of<T: Serialize + Measured + 'static>(c: Calibrated<T>, value: String) -> Solved {
        Solved { record: Box::new(c.calibration), page: c.page, value, excluded: c.missing }
    }
}

/// Opens the recordings of an order. `leave_out` are frames that are not used, counted from 0 over all recordings.
fn open(at: &At, names: &[&String], leave_out: &[usize]) -> Result<Vec<Recording>> {
    let mut recordings = names.iter().map(|name| at.recording(name)).collect::<Result<Vec<Recording>>>()?;
    let all: usize = recordings.iter().map(|r| r.meta.frames.len()).sum();
    if let Some(strange) = leave_out.iter().find(|i| **i >= all) {
        return Err(
            Fault::usage(format!("frame {strange} shall be excluded, but there are {all}")).next("choose one of them")
        );
    }
    let mut index = 0;
    for recording in &mut recordings {
        // The other frames keep their poses.
        for (i, frame) in recording.meta.frames.iter_mut().enumerate() {
            frame.pose.get_or_insert(i);
        }
        recording.meta.frames.retain(|_| {
            index += 1;
            !leave_out.contains(&(index - 1))
        });
    }
    Ok(recordings)
}

/// The same for an order of one recording.
fn open_one(at: &At, name: &String, leave_out: &[usize]) -> Result<Recording> {
    Ok(open(at, &[name], leave_out)?.remove(0))
}

/// Two depths in mm, from one that may be missing each.
fn range(near_mm: Option<f64>, far_mm: Option<f64>) -> Result<Option<[f64; 2]>> {
    match (near_mm, far_mm) {
        (Some(near), Some(far)) => Ok(Some([near, far])),
        (None, None) => Ok(None),
        _ => Err(Fault::usage("of near_mm and far_mm one is missing").next("state both, or neither")),
    }
}

/// Defines the order of a calibration from the targets, which are listed once.
macro_rules! orders {
    ($($(#[$doc:meta])* $target:ident($inputs:ident),)*) => {
        /// What to calibrate, and from which recording.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
        #[serde(tag = "target", rename_all = "snake_case")]
        pub enum CalibrateOrder {
            $($(#[$doc])* $target($inputs),)*
        }

        /// Target of a calibration.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, strum::IntoStaticStr, strum::VariantArray)]
        #[strum(serialize_all = "snake_case")]
        pub enum Target {
            $($(#[$doc])* $target,)*
        }

        impl Target {
            /// Whether a recording of boards suits its calibration.
            pub fn suits(self, boards: &OfBoards) -> bool {
                match self {
                    $(Target::$target => $inputs::suits(boards),)*
                }
            }
        }

        impl CalibrateOrder {
            /// The calibration of a target from a recording, with the station's settings.
            pub fn new(target: Target, recording: String) -> CalibrateOrder {
                match target {
                    $(Target::$target => {
                        CalibrateOrder::$target($inputs { recording: recording.into(), ..$inputs::default() })
                    })*
                }
            }
            /// Its target.
            pub fn target(&self) -> Target {
                match self {
                    $(CalibrateOrder::$target(_) => Target::$target,)*
                }
            }
        }

        impl Calibration for CalibrateOrder {
            fn recording(&self) -> &str {
                match self {
                    $(CalibrateOrder::$target(inputs) => inputs.recording(),)*
                }
            }
            fn suits(boards: &OfBoards) -> bool {
                Target::VARIANTS.iter().any(|target| target.suits(boards))
            }
            fn solve(&self, at: &At, progress: Progress) -> Result<Solved> {
                match self {
                    $(CalibrateOrder::$target(inputs) => inputs.solve(at, progress),)*
                }
            }
        }
    };
}

orders! {
    /// Camera and lens.
    Camera(CameraOrder),
    /// Pose of the camera on the flange, or in the base.
    HandEye(HandEyeOrder),
    /// The laser plane.
    LaserPlane(LaserPlaneOrder),
    /// The pointer's beam.
    Pointer(PointerOrder),
    /// A linear axis or turntable that moves parts in front of a fixed camera.
    Axis(AxisOrder),
}

#[cfg(test)]
mod tests {
    use super::*;
    use sheetlight::calibrate::camera::lens::Lens;

    #[test]
    fn an_order_is_read_as_it_is_written_and_nothing_in_it_is_dropped() {
        let read = |rest: &str| {
            let text = format!(r#"{{"target":"camera","recording":"a"{rest}}}"#);
            serde_json::from_str::<CalibrateOrder>(&text).map_err(|error| error.to_string())
        };
        let camera = |inputs: CameraOrder| Ok(CalibrateOrder::Camera(CameraOrder { recording: "a".into(), ..inputs }));
        assert_eq!(read(""), camera(CameraOrder::default()));
        assert_eq!(read(r#","lens":null"#), camera(CameraOrder::default()));
        assert_eq!(read(r#","lens":"four""#), camera(CameraOrder { lens: Lens::Four, ..CameraOrder::default() }));
        assert_eq!(read(r#","leave_out":[3]"#), camera(CameraOrder { leave_out: vec![3], ..CameraOrder::default() }));
        assert!(read(r#","lense":"four""#).unwrap_err().contains("lense"));
        let said = read(r#","lens":"fore""#).unwrap_err();
        assert!(said.contains("fore") && said.contains("scheimpflug"), "{said}");
        // The mount belongs to the hand-eye calibration: the camera's refuses it.
        assert!(read(r#","mount":"eye-in-hand""#).is_err());
        for target in Target::VARIANTS {
            let order = CalibrateOrder::new(*target, "b".into());
            let again = serde_json::from_str(&serde_json::to_string(&order).unwrap()).unwrap();
            assert_eq!((&order, order.target(), order.recording()), (&again, *target, "b"));
        }
    }
}
