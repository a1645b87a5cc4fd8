//! In: a word that names a source of pictures (a URI). Out: frames with their ids and times, paired with poses, each one
//! accounted for; recordings.
//! Frame and unit: times in ns; poses base_from_flange, mm.

mod clock;
mod feature;
mod format;
mod picture;
pub mod source;
mod uri;
pub mod wire;

pub use clock::{RoundTrip, now_ns};
pub use feature::{Feature, Range, Value};
pub use format::{Format, RawFormat, RawFrames};
pub use picture::{Event, Picture, PictureSource};
pub use uri::CameraUri;
