//! In: nothing. Out: the messages between server and pages, one type each; the pages' declarations are generated
//! from them.
//! Frame and unit: lengths in mm, angles in degrees, times in UTC, RFC 3339; names state any other unit.

mod bar;
mod camera;
mod description;
mod door;
mod drawing;
mod filter;
mod job;
mod motion;
mod order;
mod outcome;
mod place;
mod settings;
mod surface;
mod sweep;

use description::{Message, message};

/// Lists the messages that other rooms name. What they consist of is declared and described with them.
macro_rules! messages {
    ($($($place:ident)::+ { $($message:ident,)+ })+) => {
        $(pub use $($place)::+::{$($message),+};)+

        const MESSAGES: &[Message] = &[$($(message::<$message>(),)+)+];
    };
}

messages! {
    bar { Bar, CalibrationAge, Frames, Lease, Mode, RobotState, }
    job { Event, Job, JobState, Problem, }
    order { BenchmarkOrder, Order, Outcome, Plain, TeachOrder, }
    crate::procedure { FilterOrder, FindOrder, InsertOrder, ScanOrder, TouchOrder, }
    crate::procedure::filter { Filter, }
    crate::procedure::calibrate {
        AutoOrder, AxisOrder, CalibrateOrder, CameraOrder, HandEyeOrder, JointOrder, LaserPlaneOrder, PointerOrder,
    }
    filter { Filtered, Filters, }
    outcome {
        BenchRow, CalibrationFigures, CheckLine, GateLight, Inserted, KeptUp, Notation, Position, Repeats,
        RepeatsAsk, RobotPoses, ScanFigures, Spread, SquareProposed, SurfaceTouched, Term, Touched,
    }
    camera { CameraFeature, CameraState, ExposureSet, PictureLook, SetFeature, StripeSeen, }
    motion { Arming, Asked, InTheCell, MotionState, SimulatedCell, }
    door { Confirmed, Grant, Knock, Redeem, Session, TakeLease, }
    place {
        BoardView, CalibrationState, FrameInfo, PictureRef, RecipeAsk, RecipeText, RecordingInfo, StationInfo,
        SupportAsk, ViewRef,
    }
    settings { BackupInfo, Connection, OutputAsk, SettingsAsk, SettingsState, }
    drawing { DrawingAsk, DrawingRead, NewPoint, PointChange, PointsChange, PointsChanged, PointsOf, RecipePoint, }
    surface {
        Distance, Fit, Ghost, MapHead, Measure, MeasureAnswer, Outlines, PlaneAsk, PointsAsk, Section, SectionAsk,
        SectionPoint,
    }
    sweep { Pace, SweepAsk, SweepPlan, }
}

/// Content of `docs/messages.d.ts`; a test compares the file with this.
pub fn declarations() -> String {
    description::declarations(MESSAGES)
}

/// JSON schema of every message by its name, as `components.schemas` of an OpenAPI description holds them.
pub fn schemas() -> serde_json::Map<String, serde_json::Value> {
    description::schemas(MESSAGES)
}
