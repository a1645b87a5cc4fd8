//! In: a camera whose exposure can be set. Out: pictures that were exposed after a setting; the exposure that suits the
//! stripe; several exposures in turn; the exposures that a scene of high contrast needs.
//! Frame and unit: exposure in us; shares of full scale.

mod bracketed;
mod fresh;
mod propose;
mod setting;
mod tune;

pub use bracketed::{Bracketed, Exposures};
pub use fresh::fresh;
pub use propose::{Proposal, propose};
pub use setting::unexposed;
pub use tune::{Tuned, tune};
