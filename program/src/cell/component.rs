//! In: a part of the scene with holes. Out: the component that goes into it, and the gripper that holds it, as
//! boxes and pins.
//! Frame and unit: tool frame: origin where the component's underside meets the socket's top, z against the
//! direction of insertion; mm.

use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::Vec3;
use sheetlight::simulate::{PartSpec, ShapeSpec};

/// Length of the pins below the component, mm.
pub const PIN_MM: f64 = 2.0;
/// Height of the component, mm; `FINGERS_MM` is the size of the gripper above it, mm.
const BODY_MM: f64 = 6.0;
const FINGERS_MM: [f64; 3] = [16.0, 10.0, 50.0];

/// The component in the gripper.
#[derive(Clone, Debug)]
pub struct Component {
    /// Name of the part that the component belongs to.
    pub part: String,
    /// Positions of the pins, at the underside.
    pub pins: Vec<Vec3>,
    /// Points on the surfaces of component and gripper; none of them may be inside another object.
    pub hull: Vec<Vec3>,
    /// Position of the seated tool in the part's frame, where the middle of the pins and of the socket's holes
    /// coincide, mm.
    pub seat: Vec3,
}

/// A grid of points on a box's faces.
fn on_box(x: [f64; 2], y: [f64; 2], z: [f64; 2], out: &mut Vec<Vec3>) {
    const N: usize = 4;
    let at = |r: [f64; 2], k: usize| r[0] + (r[1] - r[0]) * k as f64 / N as f64;
    for i in 0..=N {
        for j in 0..=N {
            for k in 0..=N {
                let side = [i, j, k].iter().any(|n| *n == 0 || *n == N);
                if side {
                    out.push(Vec3::new(at(x, i), at(y, j), at(z, k)));
                }
            }
        }
    }
}

/// A slot is more than this many times as long as it is wide.
const SLOT: f64 = 8.0;
/// Number of points along a card's edge that represent its contacts.
const CONTACTS: usize = 12;

/// The contacts of a card that goes into a slot; empty if the part has no slot.
fn blade(part: &PartSpec) -> Vec<Vec3> {
    let cuts =
        part.solid.iter().flat_map(|s| s.cut.iter().map(move |c| (Vec3::from(s.at_mm) + Vec3::from(c.at_mm), c)));
    let slots = cuts.filter_map(|(at, c)| match c.shape {
        ShapeSpec::Block { size_mm: [x, y, _] } if x > SLOT * y => Some((at, x)),
        _ => None,
    });
    // A card is shorter than its slot.
    let along = |(at, length): (Vec3, f64)| {
        let place = move |k: usize| at + Vec3::x() * (0.95 * length * (k as f64 / (CONTACTS - 1) as f64 - 0.5));
        (0..CONTACTS).map(place).collect()
    };
    slots.map(along).next().unwrap_or_default()
}

impl Component {
    /// The component that belongs to a part, with a pin for each hole of a pattern that repeats four times or more.
    /// A part without such holes but with a slot gets a card. Returns an error if it has neither.
    pub fn of(part: &PartSpec) -> Result<Component> {
        let holes = part.solid.iter().flat_map(|s| s.cut.iter().map(move |c| (s, c)));
        let mut pins = Vec::new();
        for (solid, cut) in
            holes.filter(|(_, c)| c.repeat[0] * c.repeat[1] >= 4 && !matches!(c.shape, ShapeSpec::Ball { .. }))
        {
            for j in 0..cut.repeat[1] {
                for i in 0..cut.repeat[0] {
                    let along = |k: u32, axis: usize| {
                        (f64::from(k) - f64::from(cut.repeat[axis] - 1) / 2.0) * cut.pitch_mm[axis]
                    };
                    pins.push(
                        Vec3::from(solid.at_mm) + Vec3::from(cut.at_mm) + Vec3::new(along(i, 0), along(j, 1), 0.0),
                    );
                }
            }
        }
        if pins.is_empty() {
            pins = blade(part);
        }
        if pins.is_empty() {
            return Err(Fault::input(format!("the part '{}' has no holes that pins could go into", part.name))
                .cause("a part without cut-outs that repeat four times or more")
                .next("name another part"));
        }
        let seat = pins.iter().sum::<Vec3>() / pins.len() as f64;
        let pins: Vec<Vec3> = pins.iter().map(|p| p - seat).collect();
        let far = |axis: usize| pins.iter().map(|p| p[axis].abs()).fold(0.0, f64::max) + 1.0;
        let (x, y) = (far(0), far(1));
        let mut hull = Vec::new();
        on_box([-x, x], [-y, y], [0.0, BODY_MM], &mut hull);
        let [fx, fy, fz] = FINGERS_MM;
        on_box([-fx / 2.0, fx / 2.0], [-fy / 2.0, fy / 2.0], [BODY_MM, BODY_MM + fz], &mut hull);
        Ok(Component { part: part.name.clone(), pins, hull, seat })
    }
}
