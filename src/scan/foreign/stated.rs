//! What a person states about a foreign file.

/// What no file says for certain, and nobody guesses.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stated {
    /// Columns and rows of a height picture are so far apart, mm; points of a cloud without lines are taken as so far
    /// apart.
    pub spacing_mm: Option<[f64; 2]>,
    /// mm in one level of a height picture, or in one unit of a cloud's coordinates.
    pub unit_mm: Option<f64>,
    /// Height of level 0, mm.
    pub offset_mm: f64,
    /// The level of a picture, or the z of a cloud, where nothing was measured; `Some(None)`: every one is a height,
    /// whatever the file says.
    pub missing: Option<Option<f64>>,
    /// The picture is seen from behind the sensor, or its rows run upwards: y runs along the rows.
    pub rows_up: bool,
    /// Standard deviation of a height, mm; measured where `None`.
    pub sigma_mm: Option<f64>,
}
