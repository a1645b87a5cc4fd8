//! In: which adapter is wanted. Out: that adapter, opened and proven to compute; stages run on it.

mod adapter;
mod open;
mod run;

pub use adapter::{Adapter, Wanted, adapters};
pub use open::Device;
pub(crate) use run::Compiled;
