//! In: where things stood, numbered; or how far an axis goes from pulse to pulse. Out: where they stood at a
//! picture's number. Gaps stay gaps.
//! Frame and unit: base_from_flange, mm, or counts.

use crate::recording::Stand;

/// Stands by number.
#[derive(Clone, Debug)]
pub enum Table {
    /// The first picture's is number 0; each number has its own.
    Rows(Vec<Option<Stand>>),
    /// An axis that triggers the camera: counts from one pulse to the next.
    Pulses(f64),
    /// The picture brings its count along (chunk data).
    Chunk,
}

impl Table {
    /// `number`: the picture's id, from the first one's on; `count`: what it brought along.
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
