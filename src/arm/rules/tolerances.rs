//! How far two poses may differ and count as the same; mm and degrees each. docs/robots.md states them.

/// Allowed movement of the arm since a plan was shown; beyond it the arm was moved by someone else.
pub const MOVED: (f64, f64) = (0.2, 0.05);
/// Allowed distance from the goal for a motion to count as arrived.
pub const ARRIVED: (f64, f64) = (0.2, 0.05);
/// Largest difference between two readings of an arm that has not moved.
pub const STILL: (f64, f64) = (0.01, 0.005);
