//! In: recordings of boards, balls, plates, stripes and spots. Out: calibrations in the station's folder.
//! Frame and unit: millimetres; each file names its frames.

pub(super) mod auto;
pub(super) mod axis;
pub(super) mod board_views;
pub(super) mod hand_eye;
pub(super) mod joint;
pub(super) mod laser_plane;
pub(super) mod latency;
pub(super) mod mount;
pub(super) mod pointer;
mod profile_report;
pub(super) mod profile_sensor;
mod room_light;
mod straight;
mod turned_light;
