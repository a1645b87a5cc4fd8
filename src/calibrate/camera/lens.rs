//! In: corners of a board in several pictures. Out: the lens terms that are estimated: chosen by the user, or by the
//! evidence of the pictures (docs/math.md, Camera calibration (8)).
//! Frame and unit: indices into `camera::NAMES`.

use crate::camera::{LENS, NAMES, SKEW};

/// Selects the lens terms that are estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, strum::EnumString, strum::IntoStaticStr, strum::VariantArray)]
#[strum(serialize_all = "lowercase", parse_err_ty = String, parse_err_fn = unknown)]
pub enum Lens {
    /// k1 k2 p1 p2 k3; terms that the pictures do not determine are held at zero. One of the families below is added
    /// if held-out pictures fit better with it. The report states both choices.
    #[default]
    Evidence,
    /// No distortion: a pinhole camera.
    None,
    /// k1 only.
    One,
    /// k1 k2 p1 p2.
    Four,
    /// k1 k2 p1 p2 k3, always.
    Five,
    /// The five terms, and k4 k5 k6.
    Rational,
    /// The five terms, and s1 s2 s3 s4.
    Prism,
    /// k1 k2 k3 and the sensor's tilt. p1 and p2 stay zero: either pair shifts the centre of the radial terms
    /// relative to the principal point, and pictures of boards hardly separate the two.
    Scheimpflug,
    /// All fourteen terms.
    All,
}

fn unknown(word: &str) -> String {
    crate::fault::unknown::<Lens>("lens", word)
}

const BROWN: &[usize] = &[4, 5, 6, 7, 8];
pub(super) const RATIONAL: &[usize] = &[9, 10, 11];
const PRISM: &[usize] = &[12, 13, 14, 15];
const TILT: &[usize] = &[16, 17];

impl Lens {
    /// The parameters that keep their value, except the skew.
    pub fn held(self) -> Vec<usize> {
        let free = match self {
            Lens::None => Vec::new(),
            Lens::One => vec![4],
            Lens::Four => vec![4, 5, 6, 7],
            Lens::Evidence | Lens::Five => BROWN.to_vec(),
            Lens::Rational => [BROWN, RATIONAL].concat(),
            Lens::Prism => [BROWN, PRISM].concat(),
            Lens::Scheimpflug => [&[4, 5, 8][..], TILT].concat(),
            Lens::All => [BROWN, RATIONAL, PRISM, TILT].concat(),
        };
        (LENS..SKEW).filter(|i| !free.contains(i)).collect()
    }
}

/// Names of the held terms of the plain lens.
pub fn held_names(held: &[usize]) -> Vec<&'static str> {
    BROWN.iter().filter(|i| held.contains(i)).map(|&i| NAMES[i]).collect()
}

/// Names of the estimated terms beyond the plain lens.
pub fn further_names(held: &[usize]) -> Vec<&'static str> {
    [RATIONAL, PRISM, TILT].concat().iter().filter(|i| !held.contains(i)).map(|&i| NAMES[i]).collect()
}
