//! In: drawings, pictures of a part. Out: what the search looks for: edges with directions, outlines, faces.
//! Frame and unit: the part's frame, mm; pixels where a model was taught from a picture.

pub mod drawing;
pub mod drawn_edges;
pub mod edge_index;
pub mod face;
pub mod gradient;
pub mod levels;
pub mod masked;
pub mod mirror;
pub mod outline;
pub mod shape;
pub mod shape_model;
pub mod template;
