//! In: corners of a board in several pictures. Out: which of the lens's terms they determine: named by a person, or
//! chosen by what the pictures tell (docs/math.md, Camera calibration (8)).
//! Frame and unit: indices into `camera::NAMES`.

use crate::camera::{LENS, NAMES, SKEW};

/// Which lens terms are estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, strum::EnumString, strum::IntoStaticStr, strum::VariantArray)]
#[strum(serialize_all = "lowercase", parse_err_ty = String, parse_err_fn = unknown)]
pub enum Lens {
    /// k1 k2 p1 p2 k3; terms that the pictures do not determine are held at zero, and one of the families below is
    /// taken in where pictures that it was not solved from fit better with it. Either is said.
    #[default]
    Evidence,
    /// A pinhole.
    None,
    /// k1 alone.
    One,
    /// k1 k2 p1 p2.
    Four,
    /// k1 k2 p1 p2 k3, whatever comes.
    Five,
    /// The five and k4 k5 k6.
    Rational,
    /// The five and s1 s2 s3 s4.
    Prism,
    /// k1 k2 k3 and the sensor's tilt. p1 and p2 stay zero: both shift the centre of the radial terms against the
    /// principal point, and pictures of boards hardly tell one from the other.
    Scheimpflug,
    /// All fourteen.
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
    /// The parameters that keep their value, the skew apart.
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

/// Names of the terms of the plain lens that were held.
pub fn held_names(held: &[usize]) -> Vec<&'static str> {
    BROWN.iter().filter(|i| held.contains(i)).map(|&i| NAMES[i]).collect()
}

/// Names of the terms beside the plain lens's that were estimated.
pub fn further_names(held: &[usize]) -> Vec<&'static str> {
    [RATIONAL, PRISM, TILT].concat().iter().filter(|i| !held.contains(i)).map(|&i| NAMES[i]).collect()
}
