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

pub use bar::{Bar, CalibrationAge, Frames, Lease, Mode, RobotState};
pub use camera::{CameraFeature, CameraState, ExposureSet, PictureLook, SetFeature, StripeSeen};
pub use description::{declarations, schemas};
pub use door::{Confirmed, Grant, Knock, Redeem, Session, TakeLease};
pub use drawing::{DrawingAsk, DrawingRead, NewPoint, PointChange, PointsChange, PointsChanged, PointsOf, RecipePoint};
pub use filter::{Filter, FilterOrder, Filtered, Filters};
pub use job::{Event, Job, JobState, Problem};
pub use motion::{Arming, Asked, InTheCell, MotionState, SimulatedCell};
pub use order::{
    AutoOrder, BenchmarkOrder, CalibrateOrder, FindOrder, InsertOrder, JointOrder, Order, Plain, ScanOrder, Target,
    TeachOrder, TouchOrder,
};
pub use outcome::{
    BenchRow, CalibrationFigures, CheckLine, GateLight, Inserted, KeptUp, Notation, Outcome, Position, Repeats,
    RepeatsAsk, RobotPoses, ScanFigures, Spread, SquareProposed, SurfaceTouched, Term, Touched,
};
pub use place::{
    BoardView, CalibrationState, FrameInfo, PictureRef, RecipeAsk, RecipeText, RecordingInfo, StationInfo, SupportAsk,
    ViewRef,
};
pub use settings::{BackupInfo, Connection, OutputAsk, SettingsAsk, SettingsState};
pub use surface::{
    Distance, Fit, Ghost, MapHead, Measure, MeasureAnswer, Outlines, PlaneAsk, PointsAsk, Section, SectionAsk,
    SectionPoint,
};
pub use sweep::{Pace, SweepAsk, SweepPlan};
