//! In: numbers from robots, calibrations and files. Out: rigid transforms, planes and rays whose
//! coordinate frames are types, so that a product of mismatched frames does not compile.
//! Frame and unit: named in the type; millimetres, radians, f64.

mod axis;
mod covariance;
mod frame;
mod plane;
mod rigid;
mod rotation;
mod step;

pub use axis::{Axis, AxisKind, CountUnit, Riding};
pub use covariance::not_a_covariance;
pub use frame::{Base, Board, Camera, Flange, Frame, Grid, Part, Ride, Sensor, Tool};
pub use plane::{Plane, Ray, fit_plane};
pub use rigid::Rigid;
pub use rotation::{
    ORTHONORMAL_REFUSE, ORTHONORMAL_WARN, Repaired, angle_between, exp, log, orthonormalise, repair, skew,
};
pub use step::{LeftStep, Twist};

/// A pixel (u, v), px, or a point or direction in a plane.
pub type Vec2 = nalgebra::Vector2<f64>;
/// A point, mm, or a direction: x, y, z.
pub type Vec3 = nalgebra::Vector3<f64>;
/// 3 x 3: a rotation, a covariance or a homography.
pub type Mat3 = nalgebra::Matrix3<f64>;
