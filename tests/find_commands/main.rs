//! In: drawings, clouds, height maps and photographs with parts whose places are known. Out: whether the program's
//! commands teach and find them, and refuse what cannot be found with the number, the cause and the next step.
//! Frame and unit: base frame, mm and degrees; px in pictures.

#[path = "../common/mod.rs"]
mod common;

#[path = "../find/shapes.rs"]
mod shapes;

mod chain;
mod dxf;
mod foreign;
mod insertion;
mod maps;
mod matching;
mod witness;
