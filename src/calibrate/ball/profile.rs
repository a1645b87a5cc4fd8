//! In: nothing. Out: one profile of a line-profile sensor, as all readers give it.
//! Frame and unit: the sensor's frame, mm.

/// The points of one profile; places without a measurement (not finite) are left out.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// As messages and tables call it.
    pub name: String,
    /// x along the line, z away from the sensor, mm.
    pub points: Vec<[f64; 2]>,
}
