//! In: nothing. Out: what server and pages say to each other, one type a message; the pages' declarations are made from these.
//! Frame and unit: lengths in mm, angles in degrees, times in UTC, RFC 3339; each name shows another unit.

mod bar;
mod door;
mod job;
mod motion;
mod order;
mod outcome;
mod place;
mod surface;
mod typescript;

pub use bar::{Bar, CalibrationAge, Frames, Lease, Mode, RobotState};
pub use door::{Confirmed, Grant, Knock, Redeem, Session, TakeLease};
pub use job::{Event, Job, JobState, Problem};
pub use motion::{Arming, Asked, InTheCell, MotionState, SimulatedCell};
pub use order::{
    AutoOrder, CalibrateOrder, FindOrder, InsertOrder, JointOrder, Order, Plain, ScanOrder, Target, TeachOrder,
    TouchOrder,
};
pub use outcome::{
    BenchRow, CalibrationFigures, CheckLine, GateLight, Inserted, Notation, Outcome, Position, RobotPoses, ScanFigures,
    SurfaceTouched, Term, Touched,
};
pub use place::{BoardView, CalibrationState, PictureRef, RecipeText, RecordingInfo, StationInfo};
pub use surface::{
    Distance, Fit, MapHead, Measure, MeasureAnswer, PlaneAsk, PointsAsk, Section, SectionAsk, SectionPoint,
};
pub use typescript::declarations;
