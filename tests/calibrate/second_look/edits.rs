//! In: a good station and recordings of two looks. Out: the same, made wrong by one edit.
//! Frame and unit: as `world`.

use super::world::{Believed, Recorded};
use sheetlight::geometry::{Base, Flange, Rigid, Vec3, exp};
use sheetlight::robot::{zyx_deg, zyx_of};
use sheetlight::simulate::Station;

/// Another specimen of the same design.
pub fn another(b: &Believed) -> Station {
    let (w, h) = (b.station.camera.width, b.station.camera.height);
    Station::of(&b.station.rig, b.station.seed + 77).with_size(w, h)
}

/// A bracket bumped by a millimetre, in proportion on stations larger than the paper's; a small one is not bumped by
/// less.
fn millimetre(b: &Believed) -> f64 {
    b.unit.max(1.0)
}

pub type Edit = (&'static str, fn(&mut Believed, &mut [Recorded; 2]));

pub fn each_pose(
    looks: &mut [Recorded; 2],
    mut f: impl FnMut(&Rigid<Base, Flange>, &Rigid<Base, Flange>) -> Rigid<Base, Flange>,
) {
    for look in looks {
        let first = look.poses[0];
        look.poses.iter_mut().for_each(|p| *p = f(&first, p));
    }
}

/// Shifts poses against pictures by `by` shots.
pub fn delayed(looks: &mut [Recorded; 2], by: i64) {
    for look in looks {
        let n = look.poses.len() as i64;
        look.poses = (0..n).map(|i| look.poses[(i + by).clamp(0, n - 1) as usize]).collect();
    }
}

/// Pictures lost on the way: from there on each is paired with an earlier pose.
pub fn lost(looks: &mut [Recorded; 2], count: usize) {
    for look in looks {
        let middle = look.peaks.len() / 2;
        look.peaks.drain(middle..middle + count);
        look.poses.truncate(look.peaks.len());
    }
}

/// Thirty ways to make a good station or recording wrong by one edit: unit, sign, transpose, order, delay, scale,
/// mirror, frame, mixed files.
pub const EDITS: &[Edit] = &[
    ("hand-eye translation in metres", |b, _| b.hand_eye.translation *= 1e-3),
    ("hand-eye 1 mm off in x", |b, _| b.hand_eye.translation.x += millimetre(b)),
    ("hand-eye 1 mm off in y", |b, _| b.hand_eye.translation.y += millimetre(b)),
    ("hand-eye 1 mm off in z", |b, _| b.hand_eye.translation.z += millimetre(b)),
    ("hand-eye x with the other sign", |b, _| b.hand_eye.translation.x *= -1.0),
    ("hand-eye rotation transposed", |b, _| b.hand_eye.rotation = b.hand_eye.rotation.transpose()),
    ("hand-eye the other way round", |b, _| {
        let inverse = b.hand_eye.inverse();
        b.hand_eye = Rigid::new(inverse.rotation, inverse.translation);
    }),
    ("hand-eye tilted by half a degree", |b, _| b.hand_eye.rotation = exp(&(Vec3::x() * 0.0087)) * b.hand_eye.rotation),
    ("hand-eye turned by half a degree", |b, _| b.hand_eye.rotation = exp(&(Vec3::z() * 0.0087)) * b.hand_eye.rotation),
    ("hand-eye of another specimen", |b, _| b.hand_eye = another(b).flange_from_camera),
    ("plane's offset 1 mm more", |b, _| b.plane.offset += millimetre(b)),
    ("plane's offset 0.3 mm less", |b, _| b.plane.offset -= 0.3 * millimetre(b)),
    ("plane's offset 1 % less", |b, _| b.plane.offset /= 1.01),
    ("plane's normal 1.002 long", |b, _| b.plane.normal *= 1.002),
    ("plane tilted by half a degree", |b, _| b.plane.normal = exp(&(Vec3::x() * 0.0087)) * b.plane.normal),
    ("plane rolled by half a degree", |b, _| b.plane.normal = exp(&(Vec3::z() * 0.0087)) * b.plane.normal),
    ("plane of another specimen", |b, _| b.plane = another(b).laser.plane()),
    ("camera of another specimen", |b, _| b.station.camera = another(b).camera),
    ("focal length 2 % more", |b, _| {
        b.station.camera.fx *= 1.02;
        b.station.camera.fy *= 1.02;
    }),
    ("principal point 5 px off in v", |b, _| b.station.camera.cy += 5.0),
    ("principal point 5 px off in u", |b, _| b.station.camera.cx += 5.0),
    ("lens forgotten", |b, _| b.station.camera.distortion = Default::default()),
    ("poses early by three shots", |_, l| delayed(l, 3)),
    ("poses late by one shot", |_, l| delayed(l, -1)),
    ("one picture lost", |_, l| lost(l, 1)),
    ("three pictures lost", |_, l| lost(l, 3)),
    ("camera's ReverseX on", |b, l| {
        let last = f64::from(b.station.camera.width) - 1.0;
        l.iter_mut().for_each(|k| k.peaks.iter_mut().flatten().for_each(|p| p.px.x = last - p.px.x))
    }),
    ("camera's ReverseY on", |b, l| {
        let last = f64::from(b.station.camera.height) - 1.0;
        l.iter_mut().for_each(|k| k.peaks.iter_mut().flatten().for_each(|p| p.px.y = last - p.px.y))
    }),
    ("steps scaled by 1.02", |_, l| {
        each_pose(l, |first, p| Rigid::new(p.rotation, first.translation + (p.translation - first.translation) * 1.02))
    }),
    ("steps scaled by 0.98", |_, l| {
        each_pose(l, |first, p| Rigid::new(p.rotation, first.translation + (p.translation - first.translation) * 0.98))
    }),
    ("poses' rotation transposed", |_, l| each_pose(l, |_, p| Rigid::new(p.rotation.transpose(), p.translation))),
    ("poses' angles in the other order", |_, l| {
        each_pose(l, |_, p| {
            let [z, y, x] = zyx_of(&p.rotation);
            Rigid::new(zyx_deg(x, y, z), p.translation)
        })
    }),
];

/// Errors of a few of the calibrations' own sigmas: looks cannot show them all, but what passes is within what the
/// report says that the looks leave unseen.
pub const FAINT: &[Edit] = &[
    ("plane's offset 0.2 % less", |b, _| b.plane.offset /= 1.002),
    ("plane's offset 0.1 mm more", |b, _| b.plane.offset += 0.1 * b.unit),
    ("plane's offset 0.3 mm less of the paper's", |b, _| b.plane.offset -= 0.3 * b.unit),
    ("hand-eye 0.3 mm off in z", |b, _| b.hand_eye.translation.z += 0.3 * b.unit),
    ("hand-eye 1 mm off in z of the paper's", |b, _| b.hand_eye.translation.z += b.unit),
    ("hand-eye tilted by a twentieth of a degree", |b, _| {
        b.hand_eye.rotation = exp(&(Vec3::x() * 8.7e-4)) * b.hand_eye.rotation
    }),
    ("plane tilted by a fortieth of a degree", |b, _| b.plane.normal = exp(&(Vec3::x() * 4.4e-4)) * b.plane.normal),
];
