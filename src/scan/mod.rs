//! In: shots with poses and a calibrated rig. Out: point clouds, height maps and the files that hold them.
//! Frame and unit: clouds in the frame of what is measured ([`crate::recording::Motion::frame`], mostly the robot's
//! base), height maps in a separate grid frame; mm.

mod ambient;
mod captured;
mod carrier;
mod cloud;
mod engine;
mod extraction;
mod foreign;
mod live;
mod map;
pub mod overlay;
mod pcd;
mod pieces;
mod processor;
mod refine;
mod scanner;
mod shift;
mod shots;
mod source;

pub use crate::capture::{Format, Pictures, RawFormat, RawFrames};
pub use ambient::Ambient;
pub use captured::{RecordedSource, Say, StreamSource};
pub use carrier::{Carrier, Place, needs, parts_for, parts_for_profiles};
pub use cloud::{CloudFile, CloudPoint, CloudWriter, PointSource, read_cloud, write_cloud};
pub use engine::{Engine, Measured, Optical, StripeSeen};
pub use extraction::Extraction;
pub use foreign::{Lines, Raw, Stated, lines, read_foreign, read_foreign_page};
pub use live::Live;
pub use map::files::{MAP_FILES, MapScale};
pub use map::filter::{Filter, MOST_FILTERS};
pub use map::grid::{grid, grid_on};
pub use map::heightmap::HeightMap;
pub use map::picture::{MapPlace, Shown};
pub(crate) use map::spec::FEW_CELLS;
pub use map::spec::{GridOptions, GridSpec};
pub use pcd::write_pcd;
pub use processor::{Processor, Where, Why};
pub use refine::{PathFound, Refining, SheetFound, Straight, Thick, straight};
pub use scanner::{Profile, Scanner};
pub use shift::plateau::Plateau;
pub use shift::scan::{ShiftReport, ShiftRig, Side, shift_scan};
pub use shots::{Along, SHOTS_FILE, Shots, ShotsWriter};
pub use source::{BadShot, Merged, RawSource, RecordingSource, Shot, Source};
