//! In: nothing. Out: height maps, sections and measurements, as pages request them.
//! Frame and unit: the height map's grid frame, mm, degrees.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use ts_rs::TS;

/// Description of a map's layers; each layer is `width * height` floats, little endian, row 0 first, NaN if
/// missing.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct MapHead {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Cell size, mm; the centre of cell (i, j) is at ((i + 0.5) cell, (j + 0.5) cell).
    pub cell_mm: f64,
    /// Pose of the grid in the cloud's frame: row-major 4x4, mm.
    pub base_from_grid: [f64; 16],
    /// Range that contains 99 % of the heights, mm.
    pub z_mm: [f64; 2],
    /// The same for the standard deviation, mm.
    pub sigma_mm: [f64; 2],
    /// The same for the stripe's amplitude, grey levels.
    pub intensity: [f64; 2],
}

/// Outlines of a found part.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct Outlines {
    /// Frame of the scan: base, axis, flange or map.
    pub frame: String,
    /// One line per shape, x y z in that frame, mm; closed lines end at their first point.
    pub lines: Vec<Vec<[f64; 3]>>,
}

/// The same outlines as the camera on the gripper sees them.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct Ghost {
    /// Number of the picture that they belong to.
    #[ts(type = "number")]
    pub number: u64,
    /// u and v, px; lines end where they leave the lens's field of view.
    pub lines: Vec<Vec<[f64; 2]>>,
    /// How far the arm's motion between the pose readings before and after the picture shifts the outlines, px; 0:
    /// the arm stood still.
    pub moved_px: f64,
}

/// A line over the map.
#[derive(Clone, Debug, PartialEq, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SectionAsk {
    /// Start, mm.
    pub from: [f64; 2],
    /// End, mm.
    pub to: [f64; 2],
    /// Pieces of the section to which lines are fitted: start and end along the section, mm; at most two.
    #[serde(default)]
    pub fits: Vec<[f64; 2]>,
}

/// A point of a section.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct SectionPoint {
    /// Distance along the section, mm.
    pub s: f64,
    /// Height, mm; null if nothing was measured.
    pub z: Option<f64>,
    /// Its standard deviation, mm.
    pub sigma: Option<f64>,
}

/// A line fitted to a piece of a section: z = height + slope (s - middle).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct Fit {
    /// Start and end along the section, mm.
    pub piece: [f64; 2],
    /// Height at its middle, mm.
    pub height_mm: f64,
    /// Standard deviation of the height, mm.
    pub height_sigma_mm: f64,
    /// Its angle to the grid's plane, degrees.
    pub angle_deg: f64,
    /// Standard deviation of the angle, degrees.
    pub angle_sigma_deg: f64,
    /// Distance of the points from the line, rms, mm.
    pub rms_mm: f64,
    /// Number of points in the fit.
    pub places: usize,
}

/// Result of a section.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct Section {
    /// Its length, mm.
    pub length_mm: f64,
    /// One point per half cell.
    pub points: Vec<SectionPoint>,
    /// One fit per piece.
    pub fits: Vec<Fit>,
    /// Height of the second piece's middle above the first piece's line, mm; only with two pieces.
    pub step: Option<Distance>,
    /// Angle between the two lines, degrees.
    pub angle: Option<Distance>,
}

/// A value and its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct Distance {
    /// mm, or degrees for an angle.
    pub value: f64,
    /// Standard deviation, in the same unit.
    pub sigma: f64,
}

/// A measurement on the map.
#[derive(Clone, Debug, PartialEq, Deserialize, TS, JsonSchema)]
#[serde(tag = "measure", rename_all = "snake_case")]
pub enum Measure {
    /// Distance between two points.
    TwoPoints(PointsAsk),
    /// Distance of a point from the plane fitted to a box's surface, along the plane's normal.
    PointToPlane(PlaneAsk),
}

/// Two points.
#[derive(Clone, Debug, PartialEq, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointsAsk {
    /// First point, mm in the grid.
    pub a: [f64; 2],
    /// Second point, mm in the grid.
    pub b: [f64; 2],
}

/// A point and a plane.
#[derive(Clone, Debug, PartialEq, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaneAsk {
    /// The point, mm in the grid.
    pub point: [f64; 2],
    /// Corners of the box to whose surface the plane is fitted: x0 y0 x1 y1, mm in the grid.
    pub plane: [f64; 4],
}

/// Result of a measurement.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct MeasureAnswer {
    /// The distance, mm; positive for a point above its plane.
    pub distance: Distance,
    /// Components along x, y, z of the grid, mm; only for two points.
    pub along: Option<[f64; 3]>,
    /// Tilt of the plane relative to the grid, degrees.
    pub tilt: Option<Distance>,
    /// Distance of the plane's cells from it, rms, mm.
    pub rms_mm: Option<f64>,
    /// Number of cells used.
    pub cells: usize,
}
