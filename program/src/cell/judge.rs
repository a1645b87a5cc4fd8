//! In: the component's true pose, and the true scene. Out: whether it was inserted, its offset, and what it hit.
//! Frame and unit: base frame, mm, degrees. Measurements are not used here.

use super::component::{Component, PIN_MM};
use super::log::{Event, Insertion};
use sheetlight::geometry::{Base, Part, Rigid, Tool, Vec3};
use sheetlight::simulate::{InScene, Scene};

/// A pin this far from its hole's axis still enters the hole: the funnel of a turned contact, less the pin.
const CAPTURE_MM: f64 = 0.45;
/// Range of heights at which a component counts as down but not pressed into the board, mm.
const DOWN_MM: [f64; 2] = [-0.4, 0.4];
/// Depths below this are contact, not collision, mm.
const CONTACT_MM: f64 = 0.3;

/// Pose of the component relative to its socket.
pub fn insertion(
    component: &Component,
    base_from_tool: &Rigid<Base, Tool>,
    base_from_part: &Rigid<Base, Part>,
) -> Insertion {
    let part_from_tool = base_from_part.inverse() * *base_from_tool;
    let off = part_from_tool.translation - component.seat;
    let r = &part_from_tool.rotation;
    let turn_deg = r[(1, 0)].atan2(r[(0, 0)]).to_degrees();
    let tilt_deg = r[(2, 2)].clamp(-1.0, 1.0).acos().to_degrees();
    // Each pin is compared with its own hole: a symmetric component turned by half a turn does not count as
    // inserted.
    let holes: Vec<Vec3> = component.pins.iter().map(|p| p + component.seat).collect();
    let worst_pin_mm = component
        .pins
        .iter()
        .zip(&holes)
        .map(|(pin, own)| (part_from_tool.point(pin) - own).xy().norm())
        .fold(0.0, f64::max);
    let height_mm = off.z;
    let inserted = worst_pin_mm <= CAPTURE_MM && (DOWN_MM[0]..=DOWN_MM[1]).contains(&height_mm) && tilt_deg < 1.0;
    Insertion { lateral_mm: off.xy().norm(), turn_deg, tilt_deg, height_mm, worst_pin_mm, inserted }
}

/// The deepest point of component or gripper inside another object; `None` if nothing collides.
pub fn collision(
    component: Option<&Component>,
    hull: &[Vec3],
    base_from_tool: &Rigid<Base, Tool>,
    scene: &Scene,
    base_from_scene: &Rigid<Base, InScene>,
) -> Option<Event> {
    let scene_from_tool = base_from_scene.inverse() * *base_from_tool;
    let depth = |p: &Vec3| -scene.clearance(&scene_from_tool.point(p));
    let tips = component.into_iter().flat_map(|c| c.pins.iter().map(|p| (p - Vec3::z() * PIN_MM, true)));
    let all = tips.chain(hull.iter().map(|p| (*p, false)));
    let (deepest, pin, p) = all.map(|(p, pin)| (depth(&p), pin, p)).max_by(|a, b| a.0.total_cmp(&b.0))?;
    (deepest > CONTACT_MM).then(|| Event::Collision { at: base_from_tool.point(&p).into(), depth_mm: deepest, pin })
}
