//! Adapts boards with markers to a detector that only supports boards whose first square is black and whose first id
//! is 0.
//!
//! OpenCV before 4.6 drew boards with an even number of rows starting with a white square. After a half turn (odd
//! columns) or a quarter turn (even columns) such a board starts with a black square. Its markers are then rotated
//! and in another order. A dictionary of their rotated codes in that order makes it a board that the detector
//! supports.

use crate::fault::{Fault, Result};
use crate::recording::{BoardSpec, Markers};
use calib_targets_charuco::Dictionary;
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// Rotation of the board for the detector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Turn {
    None,
    Quarter,
    Half,
}

/// A board in the form that the detector gets.
#[derive(Clone, Copy, Debug)]
pub struct Turned {
    turn: Turn,
    /// Columns and rows of the board as described.
    squares: [u32; 2],
}

impl Turned {
    /// `None` for a board that no rotation makes start with a black square: white first, columns and rows odd.
    pub fn of(squares: [u32; 2], white: bool) -> Option<Turned> {
        let turn = match (white, squares[0].is_multiple_of(2), squares[1].is_multiple_of(2)) {
            (false, ..) => Turn::None,
            (true, true, _) => Turn::Quarter,
            (true, false, true) => Turn::Half,
            (true, false, false) => return None,
        };
        Some(Turned { turn, squares })
    }

    /// Columns and rows of the rotated board.
    pub fn squares(&self) -> [u32; 2] {
        let [c, r] = self.squares;
        if self.turn == Turn::Quarter { [r, c] } else { [c, r] }
    }

    /// Position on the described board of a corner of the rotated board, both in squares from the origin.
    pub fn back(&self, [x, y]: [usize; 2]) -> [usize; 2] {
        let [c, r] = self.squares.map(|n| n as usize);
        match self.turn {
            Turn::None => [x, y],
            Turn::Quarter => [c - y, x],
            Turn::Half => [c - x, r - y],
        }
    }

    /// New position of cell (column, row) of `nx` x `ny` cells: the squares of the board, or the cells of a marker.
    fn cell(&self, [i, j]: [usize; 2], [nx, ny]: [usize; 2]) -> [usize; 2] {
        match self.turn {
            Turn::None => [i, j],
            Turn::Quarter => [j, nx - 1 - i],
            Turn::Half => [nx - 1 - i, ny - 1 - j],
        }
    }

    fn code(&self, code: u64, bits: usize) -> u64 {
        let cells = (0..bits * bits).filter(|k| code >> k & 1 == 1).map(|k| self.cell([k % bits, k / bits], [bits; 2]));
        cells.fold(0, |sum, [i, j]| sum | 1 << (j * bits + i))
    }

    /// The board's codes as they appear on the rotated board, in the order of its markers.
    ///
    /// # Errors
    /// An unknown dictionary, one with too few codes, or codes that the detector refuses.
    pub fn dictionary(&self, board: &BoardSpec) -> Result<Dictionary> {
        let Some(markers) = Markers::of(board)? else {
            return Err(Fault::input("the board has no markers").next("describe a ChArUco board"));
        };
        let (all, bits) = (markers.dictionary(), markers.dictionary().marker_size());
        let places: Vec<_> = markers.places().collect();
        if self.turn == Turn::None && places.first().is_none_or(|&(.., id)| id == 0) {
            return Ok(all);
        }
        let squares = self.squares.map(|n| n as usize);
        // The rotated board also counts its markers row by row.
        let codes: BTreeMap<[usize; 2], u64> = places
            .iter()
            .map(|&(i, j, id)| {
                let [column, row] = self.cell([i as usize, j as usize], squares);
                ([row, column], self.code(all.codes()[id], bits))
            })
            .collect();
        let codes = kept(codes.into_values().collect());
        Dictionary::from_static_codes(all.name(), bits, all.max_correction_bits(), codes).map_err(|e| {
            Fault::input(format!("the markers cannot be distinguished: {e}"))
                .cause("two markers of the board have one code")
                .next("correct the dictionary and first_id in the board's description")
        })
    }
}

/// The detector needs codes with static lifetime: each list is stored once.
fn kept(codes: Vec<u64>) -> &'static [u64] {
    static LISTS: Mutex<Vec<&'static [u64]>> = Mutex::new(Vec::new());
    let mut lists = LISTS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(list) = lists.iter().find(|l| **l == codes) {
        return list;
    }
    let list: &'static [u64] = codes.leak();
    lists.push(list);
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    fn white(squares: [u32; 2], first_id: u32) -> BoardSpec {
        BoardSpec::Charuco {
            squares,
            square_mm: 10.0,
            marker_mm: 7.0,
            dictionary: "DICT_4X4_100".into(),
            first_id,
            first_square: Some("white".into()),
            border_mm: 0.0,
        }
    }

    #[test]
    fn a_turned_board_is_the_same_print() {
        for squares in [[8, 6], [7, 6], [8, 5]] {
            let board = white(squares, 3);
            let (turned, was) = (Turned::of(squares, true).unwrap(), Markers::of(&board).unwrap().unwrap());
            let codes = turned.dictionary(&board).unwrap();
            let bits = codes.marker_size();
            assert_eq!(codes.codes().len(), was.places().count());
            // The k-th white square of a board that starts with black.
            let [nx, ny] = turned.squares();
            let places = (0..ny).flat_map(|j| (0..nx).map(move |i| [i, j])).filter(|[i, j]| (i + j) % 2 == 1);
            for (k, [i, j]) in places.enumerate() {
                for cell in 0..bits * bits {
                    // The middle of a cell, in fractions of a square, is mapped back and looked up in the print.
                    let at = |n: usize| 0.15 + 0.7 * (n as f64 + 1.5) / (bits + 2) as f64;
                    let (x, y) = (f64::from(i) + at(cell % bits), f64::from(j) + at(cell / bits));
                    let [c, r] = squares.map(f64::from);
                    let (x, y) = if squares[0] % 2 == 0 { (c - y, x) } else { (c - x, r - y) };
                    let black = codes.codes()[k] >> cell & 1 == 1;
                    assert_eq!(was.black_at(10.0 * x, 10.0 * y), black, "{squares:?}, marker {k}, cell {cell}");
                }
            }
        }
        assert!(Turned::of([7, 5], true).is_none());
    }

    #[test]
    fn a_list_is_stored_once() {
        let [a, b] = [kept(vec![1, 2, 3]), kept(vec![1, 2, 3])];
        assert!(std::ptr::eq(a, b));
    }
}
