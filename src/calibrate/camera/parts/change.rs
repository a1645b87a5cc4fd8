//! Ways in which the camera of some pictures may differ from that of the others, and their wording. Focal lengths are
//! relative; positions are in px.

use crate::camera::{Flip, Intrinsics, PARAMETERS, Parameters};
use nalgebra::{DMatrix, DVector};

/// Difference in readout or camera between some pictures and the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// No difference.
    Same,
    Flip(Flip),
    /// Another focal length.
    Focus,
    /// Another region of the sensor.
    Region,
    /// Another focal length and another region.
    Camera,
}

/// The kinds with free parameters; flips have none.
pub const FREE: [Kind; 3] = [Kind::Focus, Kind::Region, Kind::Camera];

/// Smaller changes are not reported. A warming lens moves by as much, and so does the error of the lens model between
/// near and distant boards.
const LEAST_PX: f64 = 1.5;
const LEAST_FOCUS: f64 = 0.003;

impl Kind {
    /// Derivatives of the camera's parameters by the parameters of this kind: one column each.
    pub fn directions(self, k: &Intrinsics) -> DMatrix<f64> {
        let mut focus = Parameters::zeros();
        (focus[0], focus[1]) = (k.fx, k.fy);
        let axis = |i: usize| Parameters::from_fn(|row, _| f64::from(u8::from(row == i)));
        let columns = match self {
            Kind::Same | Kind::Flip(_) => vec![],
            Kind::Focus => vec![focus],
            Kind::Region => vec![axis(2), axis(3)],
            Kind::Camera => vec![focus, axis(2), axis(3)],
        };
        DMatrix::from_fn(PARAMETERS, columns.len(), |row, c| columns[c][row])
    }

    /// The kind whose parameters are used to measure the scatter: a flip has none and uses those of a region.
    pub fn compared(self) -> Kind {
        if matches!(self, Kind::Flip(_)) { Kind::Region } else { self }
    }

    /// The camera of these pictures, computed from the camera of the others.
    pub fn camera(self, first: &Intrinsics, change: &DVector<f64>) -> Intrinsics {
        match self {
            Kind::Flip(flip) => first.flipped(flip),
            _ => {
                let moved = self.directions(first) * change;
                first.with_parameters(&(first.parameters() + Parameters::from_column_slice(moved.as_slice())))
            }
        }
    }

    /// Signs of the derivatives of the second camera's parameters by those of the first.
    pub fn signs(self, first: &Intrinsics) -> Parameters {
        let Kind::Flip(flip) = self else { return Parameters::repeat(1.0) };
        let one = first.with_parameters(&Parameters::repeat(1.0)).flipped(flip).parameters();
        let two = first.with_parameters(&Parameters::repeat(2.0)).flipped(flip).parameters();
        two - one
    }

    fn focus_and_region(self, change: &DVector<f64>) -> (f64, [f64; 2]) {
        match self {
            Kind::Same | Kind::Flip(_) => (0.0, [0.0; 2]),
            Kind::Focus => (change[0], [0.0; 2]),
            Kind::Region => (0.0, [change[0], change[1]]),
            Kind::Camera => (change[0], [change[1], change[2]]),
        }
    }

    /// Whether the change is large enough to be reported.
    pub fn is_visible(self, change: &DVector<f64>) -> bool {
        let (focus, [x, y]) = self.focus_and_region(change);
        matches!(self, Kind::Flip(_)) || focus.abs() > LEAST_FOCUS || x.hypot(y) > LEAST_PX
    }

    /// Completes the sentence "The pictures are ...".
    pub fn words(self, change: &DVector<f64>) -> String {
        let (focus, [x, y]) = self.focus_and_region(change);
        let length = format!("{:.2} % {}", 100.0 * focus.abs(), if focus > 0.0 { "longer" } else { "shorter" });
        match self {
            Kind::Same => "as the others".into(),
            Kind::Flip(flip) => flip.words().into(),
            Kind::Focus => format!("of a focal length that is {length}"),
            Kind::Region => format!("of a region of the sensor that begins {}", further(-x, -y)),
            Kind::Camera => {
                format!("of another camera: its focal length is {length}, its principal point lies {}", further(x, y))
            }
        }
    }

    pub fn cause(self) -> &'static str {
        match self {
            Kind::Same => "nothing differs",
            Kind::Flip(_) => {
                "a program turned it when it was saved, or the camera's ReverseX and ReverseY were changed: turn it \
                 back, or take it again"
            }
            Kind::Focus => "the lens was focused or zoomed in between",
            Kind::Region => "these pictures were cropped, or the camera's region was moved in between",
            Kind::Camera => "two cameras took the pictures, or lens and region were changed in between",
        }
    }
}

/// A shift in the picture, in words.
fn further(x: f64, y: f64) -> String {
    let side =
        |v: f64, [less, more]: [&str; 2]| format!("{:.1} px further {}", v.abs(), if v < 0.0 { less } else { more });
    format!("{} and {}", side(x, ["left", "right"]), side(y, ["up", "down"]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shifts_are_said_towards_their_side() {
        assert_eq!(further(-17.7, 14.25), "17.7 px further left and 14.2 px further down");
        assert_eq!(further(3.0, -0.5), "3.0 px further right and 0.5 px further up");
    }

    #[test]
    fn signs_are_the_flips_derivatives() {
        let k = Intrinsics {
            fx: 700.0,
            fy: 690.0,
            cx: 331.0,
            cy: 222.0,
            skew: 0.5,
            distortion: [-0.2, 0.05, 1e-3, -5e-4, 0.01].into(),
            width: 640,
            height: 480,
        };
        for flip in Flip::ALL {
            let signs = Kind::Flip(flip).signs(&k);
            for i in 0..PARAMETERS {
                let mut moved = k.parameters();
                moved[i] += 1e-3;
                let by = k.with_parameters(&moved).flipped(flip).parameters() - k.flipped(flip).parameters();
                assert!((by[i] - 1e-3 * signs[i]).abs() < 1e-9, "{flip:?} {i}: {by}");
            }
        }
    }
}
