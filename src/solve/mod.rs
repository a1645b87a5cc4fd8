//! In: residuals with Jacobians, point sets, seeds. Out: least-squares solutions with covariance,
//! robust weights, seeded consensus (RANSAC).
//! Frame and unit: none; the caller's. Residuals are best given in units of their own sigma.

mod consensus;
mod lm;
mod loss;
mod system;

pub use consensus::{Consensus, ConsensusOptions, consensus};
pub use lm::{LmOptions, Problem, Solution, Stop, lm, worst_jacobian_error};
pub use loss::{Loss, robust_scale};
pub use system::Residuals;
