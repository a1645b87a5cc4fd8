//! In: shots with poses and a calibrated rig. Out: point clouds, height maps and the files that hold them.
//! Frame and unit: clouds in the robot's base frame, height maps in a grid frame of their own; mm.

mod ambient;
mod cloud;
mod crossing;
mod engine;
mod extraction;
mod filling;
mod grid;
mod heightmap;
mod live;
mod map_files;
mod map_picture;
pub mod overlay;
mod pcd;
mod plateau;
mod processor;
mod scanner;
mod shift;
mod source;

pub use ambient::Ambient;
pub use cloud::{CloudFile, CloudPoint, CloudWriter, PointSource, read_cloud, write_cloud};
pub use engine::{Engine, Measured, Optical};
pub use extraction::Extraction;
pub use grid::{GridOptions, GridSpec, grid, grid_on};
pub use heightmap::HeightMap;
pub use live::{Live, Newest};
pub use map_files::{MAP_FILES, MapScale};
pub use map_picture::{MapPlace, Shown};
pub use pcd::write_pcd;
pub use plateau::Plateau;
pub use processor::{Processor, Where, Why};
pub use scanner::{Profile, Scanner, camera_for};
pub use shift::{ShiftReport, ShiftRig, Side, shift_scan};
pub use source::{BadShot, Format, RawFormat, RawFrames, RawSource, RecordingSource, Shot, Source};
