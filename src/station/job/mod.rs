//! In: a robot behind its rules, a camera, a station, a recipe, a person who confirms. Out: touch, square, scan,
//! find, approach, insert, retract: one state machine with its state on disk. The command line, the screen and
//! scripts all run it.
//! Frame and unit: base frame; mm, degrees.

pub(in crate::station) mod eye;
mod lit;
mod machine;
mod operator;
mod pace;
mod places;
mod preview;
mod record;
mod report;
mod shoot;
pub(in crate::station) mod snapshots;
mod state;
mod sweep;
mod touch;

pub use eye::Eye;
pub use machine::{Job, JobOptions};
pub use operator::{Ask, Operator};
pub use pace::{Can, Pace, pace};
pub use preview::{Preview, PreviewOptions, preview};
pub(in crate::station) use record::Record;
pub use report::{JobReport, Outcome};
pub use state::{JobState, Phase, Resumes};
pub use sweep::{Board, Sweep, SweepFigures, sweep};
