//! In: what careless and hostile users give the program. Out: a table (case, expected, got): each case is answered
//! with a result or with a fault that names number, limit and next step; none panics, hangs or floods the memory.
//! Frame and unit: none.

#[path = "../common/mod.rs"]
mod common;

mod bench;
mod clouds;
mod crashes;
mod drawings;
mod files;
mod inputs;
mod jobs;
mod light;
mod messages;
mod pictures;
mod poses;
mod sources;
mod stops;
mod table;
mod terminal;
