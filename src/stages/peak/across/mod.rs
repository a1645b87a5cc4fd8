//! In: a picture, a skeleton pixel, the expected stripe. Out: where a profile is taken: the pixel in the stripe's
//! middle, and the direction across the stripe. Frame and unit: pixels. docs/math.md, Stripe peak (0) and (1).

pub(in crate::stages) mod centre;
pub(in crate::stages) mod direction;
pub(in crate::stages) mod turn;
