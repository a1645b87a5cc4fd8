//! In: calibrated values, from solvers, files and users. Out: refusals of values that no rig can have, and a
//! question about values that look like another unit.
//! Frame and unit: those of the values; mm, px.

use super::measured::Measured;
use super::{Rig, Volume};
use crate::camera::Intrinsics;
use crate::fault::{Fault, Result};
use crate::geometry::{Axis, AxisKind, Camera, CountUnit, Frame, Plane, Ray, Rigid, Vec2, Vec3};

/// Largest deviation from 1 of the length of a direction in a file, from rounding. Larger deviations come from
/// edits.
const UNIT: f64 = 1e-9;
/// Limits of focal length over the picture's longer side: fields of view of 157 and of 0.3 degrees.
const FOCAL: [f64; 2] = [0.1, 200.0];
/// Largest distance of a sensor from its flange or the robot's base, and of a beam's foot point from its camera, mm.
const FARTHEST: f64 = 5000.0;
/// Distances from flange, base or camera below this, mm, look like metres.
const METRES: f64 = 2.0;

/// Default advice, for values whose caller gives none.
const AGAIN: &str = "calibrate again, or import right values with sheetlight station import";

fn bad(what: String, cause: &str) -> Fault {
    Fault::input(what).cause(cause).next(AGAIN)
}

fn unit(v: &Vec3, what: &str) -> Result<()> {
    let length = v.norm();
    if (length - 1.0).abs() <= UNIT {
        return Ok(());
    }
    Err(bad(
        format!("the {what} is {length:.6} long, it must be 1 to {UNIT:.0e}"),
        "edited by hand, or written by another program",
    ))
}

impl Measured for Intrinsics {
    fn check(&self) -> Result<()> {
        Intrinsics::check(self)?;
        let (w, h) = (f64::from(self.width), f64::from(self.height));
        let focal = [self.fx, self.fy].map(|f| f / w.max(h));
        let size = format!("a picture of {}x{}", self.width, self.height);
        if focal.iter().any(|f| !(FOCAL[0]..=FOCAL[1]).contains(f)) {
            return Err(bad(
                format!(
                    "focal lengths {} and {} px for {size} are outside {} to {} of its longer side",
                    self.fx, self.fy, FOCAL[0], FOCAL[1]
                ),
                "focal lengths in mm or as shares of the picture instead of pixels, or another picture size",
            ));
        }
        let inside = |c: f64, side: f64| c > -side && c < 2.0 * side;
        if !inside(self.cx, w)
            || !inside(self.cy, h)
            || (w.min(h) > 64.0 && self.cx.abs() <= 1.0 && self.cy.abs() <= 1.0)
        {
            return Err(bad(
                format!("the principal point ({}, {}) px is far from the middle of {size}", self.cx, self.cy),
                "another picture size, or coordinates from 0 to 1 or from the middle instead of pixels",
            ));
        }
        if !(0.2..=5.0).contains(&(self.fx / self.fy)) || self.skew.abs() > self.fx {
            return Err(bad(
                format!("fx {}, fy {} and skew {} px make no pixel", self.fx, self.fy, self.skew),
                "numbers in another order",
            ));
        }
        if self.normalised_from_pixel(&Vec2::new(w / 2.0, h / 2.0)).is_none() {
            return Err(bad(
                format!("the lens k1 k2 p1 p2 k3 = {:?} cannot be undone in the picture's middle", self.distortion),
                "coefficients of another lens model, or in another order",
            ));
        }
        Ok(())
    }
}

impl Measured for Plane<Camera> {
    fn check(&self) -> Result<()> {
        unit(&self.normal, "plane's normal")?;
        let d = self.offset.abs();
        if !(d > 1e-6 && d < 1e6) {
            return Err(bad(
                format!("the plane passes the camera at {} mm, 1e-6 to 1e6 is needed", self.offset),
                "a plane through the camera's own centre measures nothing",
            ));
        }
        Ok(())
    }
    fn doubt(&self) -> Option<String> {
        (self.offset.abs() < METRES)
            .then(|| format!("the laser plane's offset of {} mm looks like metres", self.offset))
    }
}

impl Measured for Ray<Camera> {
    fn check(&self) -> Result<()> {
        unit(&self.direction, "beam's direction")?;
        if !(self.origin.norm() < FARTHEST) {
            return Err(bad(
                format!("the beam's origin is {:.0} mm from the camera, {FARTHEST} at most", self.origin.norm()),
                "micrometres, or a slipped decimal point",
            ));
        }
        Ok(())
    }
    fn doubt(&self) -> Option<String> {
        // The foot of the perpendicular counts, because the origin may lie anywhere along the beam.
        let beside = (self.origin - self.direction * self.origin.dot(&self.direction)).norm();
        (beside < METRES).then(|| format!("the beam passes the camera at {beside:.4} mm, which looks like metres"))
    }
}

impl<To: Frame, From: Frame> Measured for Rigid<To, From> {
    fn check(&self) -> Result<()> {
        let r = &self.rotation;
        let departure = (r.transpose() * r - crate::geometry::Mat3::identity()).norm();
        let far = self.translation.norm();
        if !(departure < UNIT && r.determinant() > 0.0) {
            return Err(bad(format!("the rotation is {departure:.1e} from orthonormal"), "edited by hand"));
        }
        if !(far < 1e5) {
            return Err(bad(format!("the transform is {far:.0} mm long"), "micrometres, or a slipped decimal point"));
        }
        Ok(())
    }
    fn doubt(&self) -> Option<String> {
        let t = self.translation.norm();
        let lies = |digits: usize| format!("the {} lies {t:.digits$} mm from the origin of {}", From::NAME, To::NAME);
        // Exactly zero is a valid statement: the poses are the camera's own.
        (t > 0.0 && t < METRES)
            .then(|| format!("{}, which looks like metres", lies(4)))
            .or_else(|| (t > FARTHEST).then(|| format!("{}, which looks like micrometres", lies(0))))
    }
}

impl Measured for Axis {
    fn check(&self) -> Result<()> {
        self.camera_from_axis.check()?;
        let odd = match self.kind {
            AxisKind::Linear => self.unit == CountUnit::Deg,
            AxisKind::Turntable => self.unit == CountUnit::Mm,
        };
        if odd {
            let what = format!("a {} whose counts are in {}", self.kind.words(), self.unit.name());
            return Err(bad(what, "edited by hand"));
        }
        // Limits: a nanometre to a metre per count, and less than half a turn per count for a turntable.
        let most = if self.kind == AxisKind::Linear { 1e3 } else { std::f64::consts::PI };
        if !(self.pitch.abs() > 1e-9 && self.pitch.abs() < most) {
            let what = format!("the pitch is {} a count, 1e-9 to {most:.4} is accepted", self.pitch);
            return Err(bad(what, "an axis that did not move, or another unit"));
        }
        Ok(())
    }
}

/// Depths at which a camera sees a plane, nearest and farthest of a grid over the picture, mm; `None` if no ray meets
/// it in front of the camera.
pub fn depths_seen(camera: &Intrinsics, plane: &Plane<Camera>) -> Option<[f64; 2]> {
    let depths = (0..=16).flat_map(|i| (0..=16).map(move |j| (i, j))).filter_map(|(i, j)| {
        let px =
            Vec2::new(f64::from(i) / 16.0 * f64::from(camera.width), f64::from(j) / 16.0 * f64::from(camera.height));
        camera.ray_from_pixel(&px)?.meet(plane).map(|p| p.z)
    });
    let seen = depths.fold([f64::INFINITY, 0.0f64], |[a, b], z| [a.min(z), b.max(z)]);
    (seen[1] > 0.0).then_some(seen)
}

impl Rig {
    /// Refuses a laser plane that is nowhere visible to the camera in the working volume.
    pub fn reaches(&self, volume: Option<&Volume>) -> Result<()> {
        let depth_mm = Volume::depths(volume);
        let (Some(camera), Some(laser)) = (&self.camera, &self.laser_plane) else { return Ok(()) };
        let (camera, plane) = (&camera.value, &laser.value);
        let seen = depths_seen(camera, plane).unwrap_or([f64::INFINITY, 0.0]);
        if seen[0] <= depth_mm[1] && seen[1] >= depth_mm[0] {
            return Ok(());
        }
        let seen =
            if seen[1] > 0.0 { format!("at depths of {:.2} to {:.2} mm", seen[0], seen[1]) } else { "nowhere".into() };
        let volume = volume.map_or(String::new(), |v| format!(", the working volume is {v}"));
        Err(Fault::input(format!("the camera sees the laser plane {seen}{volume}"))
            .cause("a plane in metres or of another camera, or a working volume that is not this station's")
            .next("set working_volume in station.toml, or calibrate the laser plane again"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Flange;

    fn camera() -> Intrinsics {
        Intrinsics {
            fx: 611.6,
            fy: 611.6,
            cx: 315.0,
            cy: 232.0,
            skew: 0.0,
            distortion: Default::default(),
            width: 640,
            height: 480,
        }
    }

    #[test]
    fn cameras_that_are_none_are_refused() {
        let check = |edit: fn(&mut Intrinsics)| {
            let mut c = camera();
            edit(&mut c);
            Measured::check(&c)
        };
        check(|_| {}).unwrap();
        check(|c| (c.fx, c.fy) = (60_000.0, 60_000.0)).unwrap();
        for wrong in [
            check(|c| (c.fx, c.fy) = (8.0, 8.0)),
            check(|c| (c.fx, c.fy) = (0.95, 0.95)),
            check(|c| (c.cx, c.cy) = (0.49, 0.51)),
            check(|c| c.cx = 5000.0),
            check(|c| c.fx = 100.0),
            check(|c| c.fy = f64::NAN),
            check(|c| (c.cx, c.distortion.0[0]) = (100.0, 1e300)),
        ] {
            assert!(!wrong.unwrap_err().cause.is_empty());
        }
    }

    #[test]
    fn lengths_and_units_are_looked_at() {
        let plane: Plane<Camera> = Plane::new(Vec3::new(0.0, 0.883, 0.469), 72.0).unwrap();
        plane.check().unwrap();
        for factor in [1.01, 1.002, 1.0 + 1e-7, 0.5] {
            let mut long = plane;
            long.normal *= factor;
            assert!(long.check().unwrap_err().what.contains("long"));
        }
        assert!(plane.doubt().is_none());
        assert!(Plane::<Camera>::new(plane.normal, 0.072).unwrap().doubt().is_some());
        assert!(Plane::<Camera>::new(plane.normal, 0.0).unwrap().check().is_err());
        let hand_eye =
            |t: f64| Rigid::<Flange, Camera>::from_vectors(&Vec3::new(0.1, 0.2, 0.3), Vec3::new(t, 0.0, 0.0));
        assert!(hand_eye(104.0).doubt().is_none() && hand_eye(0.104).doubt().unwrap().contains("metres"));
        assert!(hand_eye(0.0).doubt().is_none() && hand_eye(104_000.0).doubt().is_some());
        assert!(hand_eye(1e6).check().is_err());
    }
}
