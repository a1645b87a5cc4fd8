//! In: numbered positions, or the travel of an axis from pulse to pulse. Out: the position at a picture's number.
//! Gaps are not filled.
//! Frame and unit: base_from_flange, mm, or counts.

use crate::recording::Stand;

/// Positions by number.
#[derive(Clone, Debug)]
pub enum Table {
    /// One position for each number; the first picture has number 0.
    Rows(Vec<Option<Stand>>),
    /// An axis that triggers the camera: counts from one pulse to the next.
    Pulses(f64),
    /// The picture carries its count (chunk data).
    Chunk,
}

impl Table {
    /// `number` is the picture's id counted from the first one's; `count` is the count that the picture carries.
    pub fn at(&self, number: u64, count: Option<i64>) -> Result<Stand, String> {
        match self {
            Table::Rows(rows) => match rows.get(number as usize) {
                Some(Some(stand)) => Ok(*stand),
                Some(None) => Err(format!("nothing is known of number {number}")),
                None => Err(format!("number {number}, the poses or counts end at {}", rows.len())),
            },
            Table::Pulses(step) => Ok(Stand::Count(number as f64 * step)),
            Table::Chunk => {
                count.map(|c| Stand::Count(c as f64)).ok_or_else(|| "the picture brought no count along".into())
            }
        }
    }
}
