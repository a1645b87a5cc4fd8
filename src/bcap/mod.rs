//! In: calls to a Denso robot controller. Out: b-CAP frames on the wire, and the answers to the calls.
//! Both ends use the same pure parts (variant, frame, call, exchange); only `link` and `client` do I/O.
//! Frame and unit: bytes, little endian; poses and joints as the controller writes them (mm, degrees).

mod call;
mod client;
mod exchange;
mod frame;
mod link;
mod outcome;
mod variant;

pub use call::Call;
pub use client::{Client, ClientOptions, Handle};
pub use exchange::{Exchange, Heard};
pub use frame::{Frame, LARGEST_FRAME, Splitter};
pub use link::{Link, Network};
pub use outcome::Outcome;
pub use variant::{DEEPEST, Variant};
