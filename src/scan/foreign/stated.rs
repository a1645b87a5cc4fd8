//! What the user states about a foreign file.

/// Values that no file states reliably and that are never guessed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stated {
    /// Distance of the columns and of the rows of a height picture, mm. For a cloud without lines it is the assumed
    /// distance of its points.
    pub spacing_mm: Option<[f64; 2]>,
    /// mm in one level of a height picture, or in one unit of a cloud's coordinates.
    pub unit_mm: Option<f64>,
    /// Height of level 0, mm.
    pub offset_mm: f64,
    /// The level of a picture, or the z of a cloud, that means "not measured"; `Some(None)`: every value is a
    /// height, whatever the file states.
    pub missing: Option<Option<f64>>,
    /// The picture is seen from behind the sensor, or its rows run upwards: y then points along the row order.
    pub rows_up: bool,
    /// Standard deviation of a height, mm; estimated from the data if `None`.
    pub sigma_mm: Option<f64>,
}
