//! Files that say something about their own samples: it is honoured, or refused by name, never dropped.

mod common;

#[path = "statements/clouds.rs"]
mod clouds;
#[path = "statements/handed.rs"]
mod handed;
#[path = "statements/pictures.rs"]
mod pictures;
#[path = "statements/tiff.rs"]
mod tiff;
