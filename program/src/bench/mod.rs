//! In: picture sizes and scenes. Out: the speed of the chain on this machine, stage by stage, compared with the
//! limits of its memory and upload bandwidth. Frame and unit: seconds, pixels, bytes, 1e9 bytes a second.

mod keep_up;
mod machine;
mod peer;
mod recorded;
mod rows;
mod run;
mod scaling;
mod scenes;
mod steady;
mod table;
pub mod throughput;
mod ways;

pub use keep_up::{KeptUp, keep_up};
pub use machine::{Ceilings, cpu_seconds, peak_memory_bytes};
pub use peer::serve;
pub use recorded::recorded;
pub use rows::{Latency, Row, Soak, Stage};
pub use run::{BenchOptions, Report, run, scan_chain};
pub use scaling::Scaling;
pub use scenes::{Scene, pictures};
pub use table::table;
pub use ways::{WayTime, way_times};
