//! In: finished profiles of a running scan, the depths of the boards of the laser plane's calibration. Out: a remark if
//! many points lie beyond these depths: an extrapolation, or pictures read out otherwise than at the calibration.
//! Frame and unit: along the camera's optical axis, mm.

use crate::camera::Intrinsics;
use crate::fault::Result;
use crate::geometry::{Camera, Plane, Vec2};
use crate::rig::{Rig, Volume};
use crate::scan::{Pictures, Profile};
use crate::station::volume::calibrated;

/// One point in this many is examined. A share needs no more.
const STEP: usize = 8;
/// A point counts only if it lies beyond the calibrated depths by more than this share of their range. Where the boards
/// stood nearest and farthest is chance.
const MARGIN: f64 = 0.1;
/// Least share of points beyond the depths that is remarked upon.
const WORTH_A_WORD: f64 = 0.1;
/// Another orientation of the pictures is named if it leaves at most this share beyond, and the pictures as they are
/// leave at least half.
const EXPLAINED: f64 = 0.02;
const UNEXPLAINED: f64 = 0.5;
/// Fewest examined points for a remark.
const FEWEST: u64 = 100;

/// The pictures as they are, mirrored in columns, in rows, in both.
const ORIENTATIONS: [([bool; 2], &str); 4] = [
    ([false, false], ""),
    ([true, false], "mirrored left to right"),
    ([false, true], "mirrored top to bottom"),
    ([true, true], "turned by 180 degrees"),
];

/// The calibration that points are compared with.
pub struct Calibrated {
    camera: Intrinsics,
    sheet: Plane<Camera>,
    volume: Volume,
}

/// Depths of the examined points.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Depths {
    /// Number of examined points.
    points: u64,
    /// Number of them beyond the calibrated depths, for each orientation of the pictures.
    beyond: [u64; ORIENTATIONS.len()],
    /// Nearest and farthest depth of those that lie beyond as the pictures are.
    reach: Option<[f64; 2]>,
}

impl Calibrated {
    /// `None`: the laser plane is imported, and nothing says where its boards stood.
    pub fn of(rig: &Rig, pictures: &Pictures) -> Result<Option<Calibrated>> {
        let Some(volume) = calibrated(rig) else { return Ok(None) };
        let camera = rig.need_camera()?.for_pictures(pictures.size(), pictures.readout.as_ref())?;
        Ok(Some(Calibrated { camera, sheet: rig.need_laser_plane()?.value, volume }))
    }

    /// Depth of a pixel, if the picture were turned in this way.
    fn depth(&self, u: f32, v: f32, [columns, rows]: [bool; 2]) -> Option<f64> {
        let side = |at: f32, size: u32, reversed: bool| {
            if reversed { f64::from(size) - 1.0 - f64::from(at) } else { f64::from(at) }
        };
        let px = Vec2::new(side(u, self.camera.width, columns), side(v, self.camera.height, rows));
        Some(self.camera.ray_from_pixel(&px)?.meet(&self.sheet)?.z)
    }

    fn holds(&self, depth: f64) -> bool {
        let margin = MARGIN * self.volume.length();
        (self.volume.near_mm - margin..=self.volume.far_mm + margin).contains(&depth)
    }
}

impl Depths {
    /// Counts a finished profile.
    pub fn add(&mut self, profile: &Profile, calibrated: &Calibrated) {
        for p in profile.points.iter().step_by(STEP) {
            let Some(depth) = calibrated.depth(p.u, p.v, [false, false]) else { continue };
            self.points += 1;
            if !calibrated.holds(depth) {
                let [near, far] = self.reach.unwrap_or([depth, depth]);
                self.reach = Some([near.min(depth), far.max(depth)]);
            }
            for (beyond, (reversed, _)) in self.beyond.iter_mut().zip(ORIENTATIONS) {
                *beyond += u64::from(!calibrated.depth(p.u, p.v, reversed).is_some_and(|z| calibrated.holds(z)));
            }
        }
    }

    /// What a reader of the report must know of them.
    pub fn remark(&self, calibrated: &Calibrated) -> Option<String> {
        let [near, far] = self.reach.filter(|_| self.points >= FEWEST)?;
        let share = |n: u64| n as f64 / self.points as f64;
        let here = share(self.beyond[0]);
        if here < WORTH_A_WORD {
            return None;
        }
        let volume = &calibrated.volume;
        // A slight asymmetry tells nothing: only an orientation that explains everything is named.
        let turned: Vec<&str> = (1..ORIENTATIONS.len())
            .filter(|i| here >= UNEXPLAINED && share(self.beyond[*i]) <= EXPLAINED)
            .map(|i| ORIENTATIONS[i].1)
            .collect();
        let cause = if turned.is_empty() {
            String::new()
        } else {
            format!(
                ". If no surface lies there, the pictures may be mirrored or turned since the calibration: {}, their \
                 points would lie within",
                turned.join(" or ")
            )
        };
        Some(format!(
            "{:.0} % of the points are extrapolated: they lie {} to {} mm from the camera, beyond the {} where the \
             laser plane's boards stood{cause}",
            100.0 * here,
            volume.depth(near),
            volume.depth(far),
            volume.words()
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Rigid, Vec3};
    use crate::scan::CloudPoint;

    fn calibrated() -> Calibrated {
        let camera = Intrinsics {
            fx: 600.0,
            fy: 600.0,
            cx: 319.5,
            cy: 239.5,
            skew: 0.0,
            distortion: Default::default(),
            width: 640,
            height: 480,
        };
        // The sheet leaves the camera's plane 60 mm beside it and meets the axis at 200 mm.
        let sheet = Plane::new(Vec3::new(0.0, 200.0, 60.0), 12000.0).unwrap();
        Calibrated { camera, sheet, volume: Volume::new(150.0, 190.0, "where the boards stood") }
    }

    /// A profile whose points lie at this depth on the sheet, as the picture shows them if it is turned.
    fn at(depth: f64, c: &Calibrated, reversed: [bool; 2]) -> Profile {
        let y = (12000.0 - 60.0 * depth) / 200.0;
        let row = c.camera.cy + c.camera.fy * y / depth;
        let points = (0..640).map(|u| {
            let v = if reversed[1] { 479.0 - row } else { row };
            CloudPoint { u: u as f32, v: v as f32, ..Default::default() }
        });
        Profile { shot: 0, from_camera: Rigid::identity(), peaks: Vec::new(), points: points.collect() }
    }

    #[test]
    fn points_beyond_the_boards_are_remarked_upon_and_a_turn_is_named() {
        let c = calibrated();
        let said = |profiles: &[Profile]| {
            let mut depths = Depths::default();
            for p in profiles.iter().cycle().take(2 * profiles.len()) {
                depths.add(p, &c);
            }
            depths.remark(&c)
        };
        let straight = [false, false];
        assert_eq!(said(&[at(151.0, &c, straight), at(189.0, &c, straight)]), None);
        assert_eq!(said(&[at(147.0, &c, straight)]), None, "within the margin");
        let mixed = said(&[at(160.0, &c, straight), at(212.0, &c, straight)]).unwrap();
        assert!(mixed.starts_with("50 % of the points are extrapolated: they lie 212.0 to 212.0 mm"), "{mixed}");
        let turned = said(&[at(160.0, &c, [true, true])]).unwrap();
        assert!(turned.starts_with("100 %"), "{turned}");
        assert!(turned.contains("mirrored top to bottom or turned by 180 degrees, their points"), "{turned}");
        let far = said(&[at(400.0, &c, straight)]).unwrap();
        assert!(!far.contains("turned"), "{far}");
    }
}
