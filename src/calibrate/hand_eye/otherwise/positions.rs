//! All possible meanings of a position's numbers: order, sign and unit. Lengths are in mm as read.

use crate::geometry::Vec3;
use crate::robot::Convention;

/// The order and the signs of a position's three numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Form {
    order: [usize; 3],
    sign: [f64; 3],
}

impl Form {
    /// Unchanged.
    pub const PLAIN: Form = Form { order: [0, 1, 2], sign: [1.0; 3] };

    /// Other orders, or other signs. Both at once, combined with other axes of the angles, are equivalent to one of
    /// them.
    pub fn all() -> impl Iterator<Item = Form> {
        let orders = [[0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]].map(|order| Form { order, ..Form::PLAIN });
        let signs = (0..8u8).rev().map(|bits| Form {
            sign: std::array::from_fn(|k| if bits >> k & 1 == 1 { 1.0 } else { -1.0 }),
            ..Form::PLAIN
        });
        signs.chain(orders)
    }

    /// A position in this form.
    pub fn of(&self, t: &Vec3) -> Vec3 {
        Vec3::new(t[self.order[0]] * self.sign[0], t[self.order[1]] * self.sign[1], t[self.order[2]] * self.sign[2])
    }

    /// Size of the change from the numbers as read; 0 for no change.
    pub fn changes(&self) -> u32 {
        match self {
            f if *f == Form::PLAIN => 0,
            f if f.sign == [-1.0; 3] => 1,
            _ => 2,
        }
    }

    /// In words; empty for the plain form.
    pub fn words(&self) -> String {
        let axes = ["x", "y", "z"];
        let other: Vec<&str> = (0..3).filter(|&k| self.sign[k] < 0.0).map(|k| axes[k]).collect();
        match (self.changes(), other.len()) {
            (0, _) => String::new(),
            (1, _) => "with left-handed axes".into(),
            (_, 0) => format!("with positions in the order {}", self.order.map(|k| axes[k]).join(" ")),
            _ => format!("with the other sign of {} in the positions", other.join(" and ")),
        }
    }
}

/// A unit of length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    pub name: &'static str,
    pub mm: f64,
}

const UNITS: [Unit; 5] = [
    Unit { name: "millimetres", mm: 1.0 },
    Unit { name: "metres", mm: 1000.0 },
    Unit { name: "inches", mm: 25.4 },
    Unit { name: "centimetres", mm: 10.0 },
    Unit { name: "micrometres", mm: 1e-3 },
];
/// A factor on lengths within this share of a unit's counts as that unit. A board of the wrong size is recognised
/// only with the right notation.
const NEAR: f64 = 0.03;

impl Unit {
    /// The length unit of a convention's positions.
    pub fn of(convention: Convention) -> Unit {
        let metres = convention.labels()[0].ends_with(" m");
        UNITS[usize::from(metres)]
    }
    /// The unit of the file if lengths that were read in `self` have to be multiplied by `factor`.
    pub fn times(self, factor: f64) -> Option<Unit> {
        UNITS.into_iter().find(|u| (factor * self.mm / u.mm - 1.0).abs() < NEAR)
    }
}
