//! In: poses, codes and texts. Out: how the controller writes them, and the meaning of its answers.
//! Frame and unit: mm and degrees, Denso's X Y Z RX RY RZ and figure.

use crate::bcap::Variant;
use crate::fault::Result;
use crate::geometry::{Base, Flange, Rigid};
use crate::robot::Convention;

/// A position whose figure the controller chooses.
pub fn position(pose: &Rigid<Base, Flange>) -> Variant {
    let mut numbers = Convention::Denso.write(pose);
    numbers.push(-1.0);
    Variant::F64s(numbers)
}

/// The meaning of an `OutRange` answer other than 0.
pub fn out_of_range(code: i64) -> String {
    match code {
        -1 => "no joint angles lead there: out of reach".into(),
        -2 => "a singular pose: joints 4 and 6 turn against each other".into(),
        1..=63 => {
            let joints: Vec<String> = (0..6).filter(|j| code >> j & 1 == 1).map(|j| format!("{}", j + 1)).collect();
            format!("joint {} would leave its range", joints.join(" and "))
        }
        other => format!("OutRange answers {other}, 0 was expected"),
    }
}

/// A controller's text without control characters, which could steer a terminal; at most 200 characters.
pub fn plain(text: &str) -> String {
    text.chars().filter(|c| !c.is_control()).take(200).collect()
}

/// A pose and its figure from the seven numbers of a position.
pub fn read_position(numbers: &[f64]) -> Result<(Rigid<Base, Flange>, Option<i32>)> {
    let pose = Convention::Denso.read(numbers.get(..6).unwrap_or(numbers))?;
    Ok((pose, numbers.get(6).map(|f| *f as i32)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joints_out_of_range_are_named() {
        assert_eq!(out_of_range(4), "joint 3 would leave its range");
        assert_eq!(out_of_range(0b101000), "joint 4 and 6 would leave its range");
        assert!(out_of_range(-1).contains("reach") && out_of_range(-2).contains("singular"));
    }
}
