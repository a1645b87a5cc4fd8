//! In: a scan's points, a drawing, a first pose. Out: the part's pose from the points, with covariance.
//! Frame and unit: part frame, mm, rad (docs/math.md, Insertion (1) to (4)).

pub mod construct;
mod datum;
mod edge_pieces;
mod in_plane;
mod lit_edges;
pub mod options;
pub mod points;
pub mod pose;
mod robust;
pub mod shape;
mod sizes;
pub mod slide;
pub mod surface_ends;
mod values;
