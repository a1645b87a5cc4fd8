//! In: nothing. Out: one profile of a line-profile sensor, in the form that all readers return.
//! Frame and unit: the sensor's frame, mm.

/// The points of one profile, without those that were not measured (not finite).
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// Name in messages and tables.
    pub name: String,
    /// x along the line, z away from the sensor, mm.
    pub points: Vec<[f64; 2]>,
}
