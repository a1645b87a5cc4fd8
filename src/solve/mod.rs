//! In: residuals with Jacobians, point sets, seeds. Out: least-squares solutions with covariance,
//! robust weights, seeded consensus (RANSAC).
//! Frame and unit: none; the caller's. Residuals are best given in units of their own sigma.
//!
//! Why not the crate `levenberg-marquardt`: it needs one dense Jacobian and factors it by QR. That takes 2 n² (m - n/3)
//! = 150 Mflop a step for a camera of 26 pictures (m = 2808, n = 166). Each corner touches only a few columns, so the
//! Cholesky factor takes 2 Mflop. The crate also has no states on manifolds, robust losses, held parameters or
//! covariance, which every calibration here needs.

mod consensus;
mod lm;
mod loss;
mod normal;
mod repeated;
mod system;

pub use consensus::{Consensus, ConsensusOptions, consensus};
pub use lm::{End, LmOptions, Outcome, Problem, Solution, lm, worst_jacobian_error};
pub use loss::{Loss, robust_scale};
pub use normal::Blocks;
pub use repeated::repeated;
pub use system::Residuals;
