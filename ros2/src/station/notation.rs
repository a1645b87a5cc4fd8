//! In: a pose of the inserting tool as the registers have it. Out: a quaternion.
//! Frame and unit: degrees; base_from_tool.

use clap::ValueEnum;

/// Order of a pose's angles: that of the station's notation (docs/conventions.md).
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Notation {
    Denso,
    Kuka,
    Fanuc,
    Yaskawa,
}

impl Notation {
    /// The turn as x, y, z, w. All four are Rz·Ry·Rx, and Kuka's first angle is the one about z.
    pub fn quaternion(self, angles: [f64; 3]) -> [f64; 4] {
        let [a, b, c] = angles;
        let about = if self == Notation::Kuka { [c, b, a] } else { [a, b, c] };
        let [(sx, cx), (sy, cy), (sz, cz)] = about.map(|degrees| (degrees.to_radians() / 2.0).sin_cos());
        [
            sx * cy * cz - cx * sy * sz,
            cx * sy * cz + sx * cy * sz,
            cx * cy * sz - sx * sy * cz,
            cx * cy * cz + sx * sy * sz,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 90 degrees about z turn x into y; about x first and then about z, y goes to z and stays there.
    #[test]
    fn angles_turn_in_their_order() {
        let h = 0.5f64.sqrt();
        let near = |q: [f64; 4], wanted: [f64; 4]| q.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(near(Notation::Denso.quaternion([0.0, 0.0, 90.0]), [0.0, 0.0, h, h]));
        assert!(near(Notation::Kuka.quaternion([90.0, 0.0, 0.0]), [0.0, 0.0, h, h]));
        assert!(near(Notation::Fanuc.quaternion([90.0, 0.0, 90.0]), [0.5, 0.5, 0.5, 0.5]));
        assert!(near(Notation::Yaskawa.quaternion([90.0, 90.0, 0.0]), [0.5, 0.5, -0.5, 0.5]));
    }
}
