//! In: bytes of results and their names, paths of files that others wrote. Out: files that are whole or missing,
//! sets of files that get their names together, folders that one process at a time writes into. Also: names in
//! natural order, bytes and text within size limits, rows of tables, keys of YAML files, likely typing errors in text
//! files.
//! Frame and unit: none; bytes and paths.

mod append;
mod atomic;
mod folder;
mod inputs;
mod journal;
mod leftover;
mod lock;
mod moment;
mod natural;
mod read;
mod slip;
mod table;
mod together;
mod workplace;
mod yaml;

pub use append::Append;
pub use atomic::{Aside, keep_all, write, write_aside, write_beside, write_unsynced};
pub use folder::{make_folder, remove};
pub use inputs::{not_over, not_over_any};
pub use journal::append_line;
pub use leftover::sweep;
pub use lock::Lock;
pub use moment::moment;
pub use natural::natural;
pub use read::{length, read, read_text, read_text_if_there};
pub use slip::{named, slip_at, slip_in};
pub use table::{TableRow, stated, table};
pub use together::Together;
pub use workplace::Workplace;
pub use yaml::{parse as yaml, scalar as yaml_scalar};
