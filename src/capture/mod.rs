//! In: a URI that names a source of pictures. Out: frames with their ids and times, paired with poses, each one
//! accounted for; recordings.
//! Frame and unit: times in ns; poses base_from_flange, mm.

mod account;
mod clock;
mod delay;
mod exposure;
mod feature;
mod feed;
mod format;
mod latency;
mod look;
pub mod metrics;
pub mod pair;
mod picture;
pub mod record;
pub mod source;
mod stream;
mod uri;
pub mod wire;

pub use account::{Account, Ledger, Order};
pub use clock::{ClockMap, Moment, RoundTrip, now_ns};
pub use delay::{Delay, Delays};
pub use exposure::{Bracketed, Exposures, Proposal, Tuned, fresh, propose, tune, unexposed};
pub use feature::{Feature, Range, Value};
pub use feed::{Fate, Fed, Feed, FeedOptions, Mode};
pub use format::{Format, Pictures, RawFormat, RawFrames};
pub use latency::Latency;
pub use look::{Look, PIECES, Piece, StripeLook, WANTED, look, look_at};
pub use picture::{Event, Numbering, Picture, PictureSource};
pub use stream::{Stream, Streamed};
pub use uri::CameraUri;
