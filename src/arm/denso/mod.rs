//! In: the address of a Denso controller (RC8). Out: its arm as a link.
//! Frame and unit: mm and degrees on the wire, base_from_flange in mm here.

mod arm;
mod halt;
mod session;
mod spare;
mod words;

pub(super) use arm::{Denso, Full};
