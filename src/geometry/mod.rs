//! In: numbers from robots, calibrations and files. Out: rigid transforms, planes and rays whose
//! coordinate frames are types, so that a product of mismatched frames does not compile.
//! Frame and unit: named in the type; millimetres, radians, f64.

mod axis;
mod frame;
mod plane;
mod rigid;
mod rotation;

pub use axis::{Axis, AxisKind, CountUnit, Riding, Twist};
pub use frame::{Base, Board, Camera, Flange, Frame, Grid, Part, Ride, Sensor, Tool};
pub use plane::{Plane, Ray, fit_plane};
pub use rigid::Rigid;
pub use rotation::{
    ORTHONORMAL_REFUSE, ORTHONORMAL_WARN, Repaired, angle_between, exp, log, orthonormalise, repair, skew,
};

pub type Vec2 = nalgebra::Vector2<f64>;
pub type Vec3 = nalgebra::Vector3<f64>;
pub type Mat3 = nalgebra::Matrix3<f64>;
