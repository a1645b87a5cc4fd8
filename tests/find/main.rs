//! In: drawings, clouds, height maps and photographs with parts whose places are known. Out: whether they are found
//! where they are, with an honest sigma, and nothing else is.
//! Frame and unit: base frame, mm and degrees; px in pictures.

#[path = "../common/mod.rs"]
mod common;

mod coarse;
mod matching;
mod pairs;
mod photos;
mod plate;
mod recipes;
mod rim;
mod scanned;
mod shapes;
mod sigma;
