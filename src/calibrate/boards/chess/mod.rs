//! In: pictures of chessboards, plain and with markers. Out: their inner corners with ids.
//! Frame and unit: pixels.

pub(super) mod charuco;
pub(super) mod chessboard;
mod first_square;
mod grid;
mod growth;
#[cfg(test)]
mod parity;
#[cfg(test)]
mod trials;
pub(super) mod turns;
#[cfg(test)]
mod whole;
