//! In: what a function of the interface did. Out: its number, and the words that `GCGetLastError` gives to the thread
//! that called. No panic crosses the border to C.

use crate::standard::error;
use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A refusal: the standard's number and the words for a person.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    pub code: i32,
    pub text: String,
}

pub type Result<T> = std::result::Result<T, Refusal>;

/// A refusal as the error of a result.
pub fn refuse<T>(code: i32, text: impl Into<String>) -> Result<T> {
    Err(Refusal { code, text: text.into() })
}

impl From<sheetlight::fault::Fault> for Refusal {
    fn from(fault: sheetlight::fault::Fault) -> Refusal {
        Refusal { code: error::ERROR, text: fault.to_string() }
    }
}

thread_local! {
    static LAST: RefCell<(i32, String)> = const { RefCell::new((error::SUCCESS, String::new())) };
}

/// The last refusal in this thread.
pub fn last() -> (i32, String) {
    LAST.with_borrow(Clone::clone)
}

/// Runs `body`; a panic is a refusal, because it must not go further.
pub fn caught<T>(body: impl FnOnce() -> Result<T>) -> Result<T> {
    catch_unwind(AssertUnwindSafe(body)).unwrap_or_else(|panic| {
        let said = panic.downcast_ref::<&str>().map(|s| (*s).to_owned());
        let said = said.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default();
        refuse(error::ERROR, format!("a fault of this program: {said}; please report it"))
    })
}

/// Runs the body of a function of the interface and returns its number.
pub fn guard(body: impl FnOnce() -> Result<()>) -> i32 {
    match caught(body) {
        Ok(()) => error::SUCCESS,
        Err(Refusal { code, text }) => {
            LAST.set((code, text));
            code
        }
    }
}
