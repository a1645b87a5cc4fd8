//! Pictures of a board that was described with a wrong size. If three of them agree on another size, the others need
//! not be searched. A failed search costs many times as much as a successful one.

use crate::fault::{Fault, Result};
use rayon::prelude::*;

/// Cause of the fault for a picture that shows a complete board of another size; the fault's next step names that
/// size.
pub const WRONG_SIZE: &str = "wrong board size given";
/// Number of pictures that must agree on another size.
const AGREE: usize = 3;

/// Looks at pictures 0 to `count` in parallel. It ends early if none has shown the board and three agree on another
/// size; then there are fewer results than pictures.
pub fn look_at_all<T: Send>(count: usize, look: impl Fn(usize) -> Result<T> + Sync) -> Vec<Result<T>> {
    let some = |from: usize, to: usize| (from..to).into_par_iter().map(&look).collect::<Vec<_>>();
    let mut seen: Vec<Result<T>> = Vec::new();
    while seen.len() < count && !seen.iter().any(Result::is_ok) {
        if agreed(&seen) {
            return seen;
        }
        seen.extend(some(seen.len(), (seen.len() + AGREE).min(count)));
    }
    seen.extend(some(seen.len(), count));
    seen
}

fn agreed<T>(seen: &[Result<T>]) -> bool {
    let sized: Vec<&Fault> = seen.iter().filter_map(|r| r.as_ref().err()).filter(|f| f.cause == WRONG_SIZE).collect();
    sized.iter().any(|f| sized.iter().filter(|o| o.next == f.next).count() >= AGREE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// Number of pictures, of 20, that are looked at if picture i gives the result `says(i)`.
    fn looked_at(says: impl Fn(usize) -> Result<()> + Sync) -> usize {
        let count = AtomicUsize::new(0);
        let seen = look_at_all(20, |i| {
            count.fetch_add(1, Ordering::Relaxed);
            says(i)
        });
        assert_eq!(seen.len(), count.load(Ordering::Relaxed));
        seen.len()
    }

    #[test]
    fn three_that_agree_are_enough_and_one_board_is_against_it() {
        let other = |size: &str| Err(Fault::refused("none").cause(WRONG_SIZE).next(format!("it has {size}")));
        assert_eq!(looked_at(|_| other("9x6")), 3);
        assert_eq!(looked_at(|i| if i == 1 { Err(Fault::refused("dark")) } else { other("9x6") }), 6);
        assert_eq!(looked_at(|i| if i == 2 { Ok(()) } else { other("9x6") }), 20);
        assert_eq!(looked_at(|i| other(&format!("{i}x6"))), 20);
        assert_eq!(looked_at(|_| Err(Fault::refused("dark"))), 20);
    }
}
