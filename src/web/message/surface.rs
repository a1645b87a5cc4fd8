//! In: nothing. Out: height map, section and measures as pages ask for them.
//! Frame and unit: the height map's grid frame, mm, degrees.

use serde::{Deserialize, Serialize};
use ts_rs::TS;

/// What the numbers of a map mean; each layer is `width * height` floats, little endian, row 0 first, NaN missing.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct MapHead {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Edge of a cell, mm; the centre of cell (i, j) is at ((i + 0.5) cell, (j + 0.5) cell).
    pub cell_mm: f64,
    /// Grid in the cloud's frame: row-major 4x4, mm.
    pub base_from_grid: [f64; 16],
    /// Heights between which 99 % lies, mm.
    pub z_mm: [f64; 2],
    /// The same of the standard deviation, mm.
    pub sigma_mm: [f64; 2],
    /// The same of the stripe's amplitude, grey levels.
    pub intensity: [f64; 2],
}

/// The outlines of a part that was found.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct Outlines {
    /// The scan's: base, axis, flange or map.
    pub frame: String,
    /// One a shape, x y z in that frame, mm; closed ones end where they begin.
    pub lines: Vec<Vec<[f64; 3]>>,
}

/// The same as the camera on the gripper sees them.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct Ghost {
    /// The picture over which they belong.
    #[ts(type = "number")]
    pub number: u64,
    /// u and v, px; lines end where they leave what the lens shows.
    pub lines: Vec<Vec<[f64; 2]>>,
    /// So far the arm moved them between the readings of its pose before and after the picture, px; 0: it stood.
    pub moved_px: f64,
}

/// A line over the map.
#[derive(Clone, Debug, PartialEq, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct SectionAsk {
    /// Where it begins, mm.
    pub from: [f64; 2],
    /// Where it ends, mm.
    pub to: [f64; 2],
    /// Pieces of it to which lines are fitted: from and to along the section, mm; at most two.
    #[serde(default)]
    pub fits: Vec<[f64; 2]>,
}

/// A place on a section.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, TS)]
pub struct SectionPoint {
    /// Along the section, mm.
    pub s: f64,
    /// Height; null where nothing was measured.
    pub z: Option<f64>,
    /// Its standard deviation, mm.
    pub sigma: Option<f64>,
}

/// A line through a piece of a section: z = height + slope (s - middle).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, TS)]
pub struct Fit {
    /// Where it begins and ends along the section, mm.
    pub piece: [f64; 2],
    /// Height at its middle, mm.
    pub height_mm: f64,
    /// Standard deviation of that, mm.
    pub height_sigma_mm: f64,
    /// Its angle against the grid's plane, degrees.
    pub angle_deg: f64,
    /// Standard deviation of that, degrees.
    pub angle_sigma_deg: f64,
    /// How far the places lie off it, rms, mm.
    pub rms_mm: f64,
    /// Places that it was fitted to.
    pub places: usize,
}

/// What a section shows.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct Section {
    /// Its length, mm.
    pub length_mm: f64,
    /// A place each half cell.
    pub points: Vec<SectionPoint>,
    /// One a piece.
    pub fits: Vec<Fit>,
    /// Height of the second piece's middle over the first one's line, mm; with two pieces.
    pub step: Option<Distance>,
    /// Angle between the two lines, degrees.
    pub angle: Option<Distance>,
}

/// A number and how well it is known.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, TS)]
pub struct Distance {
    /// mm, or degrees where it is an angle.
    pub value: f64,
    /// One standard deviation, in the same unit.
    pub sigma: f64,
}

/// What is measured on the map.
#[derive(Clone, Debug, PartialEq, Deserialize, TS)]
#[serde(tag = "measure", rename_all = "snake_case")]
pub enum Measure {
    /// From one place to another.
    TwoPoints(PointsAsk),
    /// From the plane through a box's surface to a place, along the plane's normal.
    PointToPlane(PlaneAsk),
}

/// Two places.
#[derive(Clone, Debug, PartialEq, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct PointsAsk {
    /// mm in the grid.
    pub a: [f64; 2],
    /// mm in the grid.
    pub b: [f64; 2],
}

/// A place and a plane.
#[derive(Clone, Debug, PartialEq, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct PlaneAsk {
    /// mm in the grid.
    pub point: [f64; 2],
    /// Corners of the box that holds the plane: x0 y0 x1 y1, mm in the grid.
    pub plane: [f64; 4],
}

/// What was measured.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct MeasureAnswer {
    /// The distance, mm; of a point above its plane positive.
    pub distance: Distance,
    /// Along x, y, z of the grid, mm; of two points.
    pub along: Option<[f64; 3]>,
    /// Of the plane against the grid, degrees.
    pub tilt: Option<Distance>,
    /// How far the plane's cells lie off it, rms, mm.
    pub rms_mm: Option<f64>,
    /// Cells that went in.
    pub cells: usize,
}
