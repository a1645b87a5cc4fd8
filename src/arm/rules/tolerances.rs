//! How far two poses may lie apart and count as one; mm and degrees each. docs/robots.md states them.

/// The arm may have moved by so much since a plan was shown: more, and it was moved by someone else.
pub const MOVED: (f64, f64) = (0.2, 0.05);
/// A motion has arrived within so much of its goal.
pub const ARRIVED: (f64, f64) = (0.2, 0.05);
/// Two readings of an arm that has not moved differ by no more.
pub const STILL: (f64, f64) = (0.01, 0.005);
