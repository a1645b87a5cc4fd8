//! Pairs pictures by number: with rows of a table, with trigger pulses, or by the count that a picture carries.

use super::table::Table;
use crate::capture::picture::{Numbering, Picture};
use crate::recording::Stand;

/// Pairs by number, and stops when an outage makes the meaning of the numbers uncertain.
pub struct Counting {
    table: Table,
    seen: Option<Seen>,
    /// The reason why nothing is paired any more.
    over: Option<&'static str>,
    said: Vec<String>,
}

/// The last picture's numbering and count, and the direction of the counts (-1, 1; 0 before they differed).
struct Seen {
    numbering: Numbering,
    count: Option<i64>,
    direction: i32,
}

const TRIGGERS: &str =
    "the connection to the camera was lost; it is unknown whether the camera counted the triggers meanwhile";
const POWER: &str = "the connection to the camera was lost; the camera's counter may have lost power";
const BACK: &str =
    "the connection to the camera was lost; the camera's count does not continue in its previous direction";

impl Counting {
    /// Pairs with this table.
    pub fn new(table: Table) -> Counting {
        Counting { table, seen: None, over: None, said: Vec::new() }
    }

    /// Position of what moves at a picture; must be called in the order of the pictures.
    pub fn at(&mut self, picture: &Picture, numbering: Numbering) -> Result<Stand, String> {
        self.look(picture, numbering);
        if let Some(why) = self.over {
            return Err(why.into());
        }
        let number = picture
            .id
            .checked_sub(numbering.first)
            .ok_or_else(|| format!("its number {} is before {}, the first one", picture.id, numbering.first))?;
        self.table.at(number, picture.count)
    }

    /// Messages since the last call.
    pub fn news(&mut self) -> Vec<String> {
        std::mem::take(&mut self.said)
    }

    fn look(&mut self, picture: &Picture, numbering: Numbering) {
        let Some(seen) = &mut self.seen else {
            self.begins(numbering);
            self.seen = Some(Seen { numbering, count: picture.count, direction: 0 });
            return;
        };
        // A picture without its count shows nothing about the counter.
        let count = picture.count.or(seen.count);
        let step = seen.count.zip(count).map_or(0, |(from, to)| to.cmp(&from) as i32);
        if numbering.outages != seen.numbering.outages && self.over.is_none() {
            self.over = match self.table {
                Table::Rows(_) | Table::Pulses(_) => Some(TRIGGERS),
                Table::Chunk if numbering.resets != seen.numbering.resets => Some(POWER),
                // Some counters are set to 0 when a camera starts to send.
                Table::Chunk if step != 0 && step != seen.direction => Some(BACK),
                Table::Chunk => None,
            };
            self.said.extend(self.over.map(|why| format!("pictures from {} on are excluded: {why}", picture.id)));
        }
        let direction = if step == 0 { seen.direction } else { step };
        *seen = Seen { numbering, count, direction };
    }

    /// Devices number from 0 or 1. A larger first number may be the first picture, or the first one that arrived.
    fn begins(&mut self, numbering: Numbering) {
        let by_number = matches!(self.table, Table::Rows(_) | Table::Pulses(_));
        if by_number && numbering.first > 1 {
            self.said.push(format!(
                "the first picture has the number {} and is paired with the first row or trigger: if earlier pictures \
                 were lost, this pairing is wrong",
                numbering.first
            ));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::Image;

    fn picture(id: u64, count: Option<i64>) -> Picture {
        let image = Image::from_u8(1, 1, vec![0]);
        Picture { image, id, device_ns: None, host_ns: 0, exposure_ns: None, count, stand: None, profiles: None }
    }

    /// The counts that pictures (number, count, outages, resets) are paired with, and the number of messages.
    fn paired(table: &Table, first: u64, pictures: &[(u64, i64, u64, u64)]) -> (Vec<Option<f64>>, usize) {
        let mut counting = Counting::new(table.clone());
        let stands = pictures.iter().map(|&(id, count, outages, resets)| {
            let stand = counting.at(&picture(id, Some(count)), Numbering { first, outages, resets });
            stand.ok().map(|s| if let Stand::Count(c) = s { c } else { panic!("a pose") })
        });
        (stands.collect(), counting.said.len())
    }

    #[test]
    fn numbers_after_an_outage_are_paired_with_nothing() {
        let rows = Table::Rows((0..9).map(|k| Some(Stand::Count(f64::from(10 * k)))).collect());
        for table in [rows, Table::Pulses(10.0)] {
            let through = [(1, 0, 0, 0), (2, 0, 0, 0), (4, 0, 0, 0)];
            let right = [Some(0.0), Some(10.0), Some(30.0)];
            assert_eq!(paired(&table, 1, &through), (right.to_vec(), 0));
            // Numbers restart or seem to go on; the clock ran on or did not. In all cases pairing stops for good.
            for after in [[(1, 0, 1, 1), (2, 0, 1, 1)], [(5, 0, 1, 0), (6, 0, 1, 0)], [(5, 0, 1, 1), (6, 0, 2, 1)]] {
                let (stands, said) = paired(&table, 1, &[&through[..], &after].concat());
                assert_eq!((stands, said), ([&right[..], &[None; 2]].concat(), 1), "{after:?}");
            }
            // No number causes a panic or a wrap-around. The very first number may be any, which is reported.
            let far = [(5000, 0, 0, 0), (5001, 0, 0, 0), (1, 0, 0, 0), (0, 0, 0, 0)];
            assert_eq!(paired(&table, 5000, &far), (vec![Some(0.0), Some(10.0), None, None], 1));
            // The first picture arrived only in part.
            assert_eq!(paired(&table, 1, &[(2, 0, 0, 0), (3, 0, 0, 0)]).0, [Some(10.0), Some(20.0)]);
        }
    }

    #[test]
    fn a_counter_is_believed_after_an_outage_only_where_it_had_power_and_went_on() {
        let before = [(1, -500, 0, 0), (2, -520, 0, 0), (3, -520, 0, 0)];
        let of = |after: (u64, i64, u64, u64)| paired(&Table::Chunk, 1, &[&before[..], &[after]].concat()).0[3];
        assert_eq!(of((4, -540, 0, 0)), Some(-540.0));
        assert_eq!(of((1, -700, 1, 0)), Some(-700.0), "its clock ran on, and so did the count");
        assert_eq!(of((1, -520, 1, 0)), Some(-520.0), "it stood still meanwhile");
        assert_eq!(of((1, -700, 1, 1)), None, "its clock began anew");
        assert_eq!(of((1, 0, 1, 0)), None, "the counter was set to 0");
        assert_eq!(of((1, i64::MAX, 1, 0)), None);
        // A single picture gives no direction.
        assert_eq!(paired(&Table::Chunk, 1, &[(1, 5, 0, 0), (2, 9, 1, 0)]).0, [Some(5.0), None]);
        // Later outages are judged like the first, and pairing that stopped stays stopped.
        let twice = [(1, 5, 0, 0), (2, 9, 0, 0), (3, 12, 1, 0), (4, 20, 2, 1), (5, 30, 2, 1)];
        assert_eq!(paired(&Table::Chunk, 1, &twice), (vec![Some(5.0), Some(9.0), Some(12.0), None, None], 1));
    }
}
