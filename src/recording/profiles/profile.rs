//! In: nothing. Out: one profile of a line-profile sensor, in the form that all readers return.
//! Frame and unit: the sensor's frame, mm.

/// One profile: every place of its line, in the sensor's order.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// Name in messages and tables.
    pub name: String,
    /// x along the line, z away from the sensor, mm. A number that is not finite means that nothing was measured there.
    pub points: Vec<[f64; 2]>,
}

/// Whether something was measured at a place.
pub fn measured(point: &[f64; 2]) -> bool {
    point.iter().all(|v| v.is_finite())
}
