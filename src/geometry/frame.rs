//! In: nothing. Out: the coordinate frames of the product as types without content.
//! Frame and unit: this file is where the frames are named; all are right-handed, millimetres.

/// A coordinate frame. `NAME` appears in files and messages.
pub trait Frame: Copy + Clone + std::fmt::Debug + PartialEq + Send + Sync + 'static {
    /// Name in files and messages, e.g. "base".
    const NAME: &'static str;
}

macro_rules! frames {
    ($($(#[$doc:meta])* $name:ident = $text:literal;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub struct $name;
        impl Frame for $name { const NAME: &'static str = $text; }
    )*};
}

frames! {
    /// Frame of clouds and insertion poses: the robot's base. In recordings of an axis it is the [`Ride`]'s frame; in
    /// recordings of a part that the robot carries, its flange's. Reports name which.
    Base = "base";
    /// The robot's mounting flange, whose pose the robot reports.
    Flange = "flange";
    /// The camera: x right, y down, z forward, origin in the centre of projection.
    Camera = "camera";
    /// A calibration board: see docs/conventions.md for the origin of each kind.
    Board = "board";
    /// A part: origin in the insertion datum, z out of the part, x along the long axis.
    Part = "part";
    /// The tool that holds the part to be inserted; z points against the direction of insertion.
    Tool = "tool";
    /// A height map: x along columns, y along rows, z up from the datum plane.
    Grid = "grid";
    /// The part's side of a linear axis or turntable, at count 0: docs/conventions.md.
    Ride = "axis";
    /// A line-profile sensor: measures in its own x-z plane, y = 0.
    Sensor = "sensor";
}
