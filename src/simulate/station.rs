//! In: a design and a seed. Out: one specimen of the station — camera, sensor, sheet of light, pointer, hand-eye —
//! all of whose values are known.
//! Frame and unit: camera and flange frames, mm, rad; pixels; grey levels as shares of full scale.

use super::rig::RigSpec;
use super::sensor::Sensor;
use crate::camera::{ALWAYS_NAMED, Distortion, Intrinsics, NAMES};
use crate::fault::Result;
use crate::geometry::{Base, Camera, Plane, Ray, Rigid, Vec3, exp};
use crate::rig::{Calibration, Covariance, HandEye, Kind, Quality, Rig, Verdict};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use std::path::Path;

/// A sheet of light from a (virtual) point source: a Gaussian beam across the sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineLaser {
    /// Apex of the fan, camera frame, mm.
    pub source: Vec3,
    /// Middle of the fan, in the sheet's plane; unit vector.
    pub axis: Vec3,
    /// Normal of the sheet; unit vector.
    pub normal: Vec3,
    /// Half of the fan's full opening angle, degrees.
    pub half_fan_deg: f64,
    /// 1/e² radius across the sheet at the waist, mm ...
    pub waist_radius: f64,
    /// ... which lies this far from the source, mm.
    pub waist_distance: f64,
    /// Wavelength, nm.
    pub wavelength_nm: f64,
}

/// A round Gaussian beam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pointer {
    /// Point where the beam leaves, camera frame, mm.
    pub source: Vec3,
    /// Direction of the beam, camera frame; unit vector.
    pub axis: Vec3,
    /// 1/e² radius at the waist, mm.
    pub waist_radius: f64,
    /// Distance of the waist from the source, mm.
    pub waist_distance: f64,
    /// Wavelength, nm.
    pub wavelength_nm: f64,
}

/// 1/e² radius of a Gaussian beam at a distance from its source, mm.
fn beam_radius(waist: f64, waist_distance: f64, wavelength_nm: f64, distance: f64) -> f64 {
    let rayleigh = std::f64::consts::PI * waist * waist / (wavelength_nm * 1e-6);
    waist * (1.0 + ((distance - waist_distance) / rayleigh).powi(2)).sqrt()
}

impl LineLaser {
    /// 1/e² radius across the sheet at a distance from the source, mm.
    pub fn radius(&self, distance: f64) -> f64 {
        beam_radius(self.waist_radius, self.waist_distance, self.wavelength_nm, distance)
    }
    /// The sheet of light, mm.
    pub fn plane(&self) -> Plane<Camera> {
        Plane::new(self.normal, self.normal.dot(&self.source)).expect("of unit length")
    }
}

impl Pointer {
    /// 1/e² radius at a distance from the source, mm.
    pub fn radius(&self, distance: f64) -> f64 {
        beam_radius(self.waist_radius, self.waist_distance, self.wavelength_nm, distance)
    }
    /// The beam, starting at its source, mm.
    pub fn ray(&self) -> Ray<Camera> {
        Ray::new(self.source, self.axis).expect("of unit length")
    }
}

/// One specimen of the station.
#[derive(Clone, Debug)]
pub struct Station {
    /// The design that it was built to.
    pub rig: RigSpec,
    /// True camera and lens.
    pub camera: Intrinsics,
    /// Conversion of light into grey levels.
    pub sensor: Sensor,
    /// The true hand-eye transform, mm.
    pub flange_from_camera: HandEye,
    /// The sheet of light, camera frame.
    pub laser: LineLaser,
    /// The pointer's beam, camera frame.
    pub pointer: Pointer,
    /// Nearest and farthest depth that the pointer measures, mm.
    pub pointer_range: [f64; 2],
    /// Camera depth of scans, mm.
    pub working_distance: f64,
    /// Seed of this specimen; 0 is the design itself.
    pub seed: u64,
}

/// The reason that a simulated calibration states for its quality.
pub const TRUE_VALUES: &str = "true values of a simulated station";

impl Station {
    /// The default design: a 5.08 mm lens on 8.3 µm pixels, the laser 77 mm below the camera at 28 degrees,
    /// the pointer 40 mm beside it; the flange 94 mm behind the camera.
    pub fn design() -> Station {
        Station::of(&RigSpec::paper(), 0)
    }

    /// A specimen of the default design.
    pub fn random(seed: u64) -> Station {
        Station::of(&RigSpec::paper(), seed)
    }

    /// A specimen of a design with manufacturing tolerances: every value deviates by up to a few per cent. Every
    /// seed gives another specimen; 0 is the design itself.
    pub fn of(rig: &RigSpec, seed: u64) -> Station {
        let mut rng = Pcg64::seed_from_u64(seed ^ 0x57a7_1011);
        let mut off = |x: f64, by: f64| if seed == 0 { x } else { x + by * rng.random_range(-1.0..1.0) };
        let camera = camera(rig, &mut off);
        let (laser, crossing) = laser(rig, &mut off);
        let working_distance = crossing * rig.working.distance_mm / rig.crossing();
        let pointer = pointer(rig, &mut off);
        let flange_from_camera = mount(rig, &mut off);
        let p = rig.pointer_spec();
        let (sensor, pointer_range) = (rig.sensor, [p.near_mm, p.far_mm]);
        let rig = rig.clone();
        Station { rig, camera, sensor, flange_from_camera, laser, pointer, pointer_range, working_distance, seed }
    }

    /// The same lens on a sensor with other pixels. The width spans the same angle; rows are added or cut off evenly
    /// above and below.
    pub fn with_size(mut self, width: u32, height: u32) -> Station {
        let scaled_height = f64::from(self.camera.height) * f64::from(width) / f64::from(self.camera.width);
        let square = Intrinsics { height: self.camera.width, ..self.camera }.scaled_to(width, width);
        self.camera = square.region(0.0, (scaled_height - f64::from(height)) / 2.0, width, height);
        self
    }

    /// Optical blur on this sensor, 1 sigma, px.
    pub fn blur_px(&self) -> f64 {
        self.sensor.blur_px * f64::from(self.camera.width) / f64::from(self.rig.camera.width_px)
    }

    /// Hot pixels of its sensor: index in row-major order from the top, extra grey as share of full scale.
    pub fn hot_pixels(&self) -> Vec<(usize, f32)> {
        let pixels = self.camera.width as usize * self.camera.height as usize;
        self.sensor.hot_pixels(pixels, &mut self.rng("hot", 0))
    }

    /// Writes the true values as the calibration of a station folder. Later random draws use the independent streams
    /// of [`Station::rng`].
    pub fn store(&self, folder: &Path) -> Result<()> {
        self.calibrations(None).store_all(folder).map(|_| ())
    }

    /// The true values as a calibrated rig. With `base_from_camera` it is the rig of a fixed sensor, and this pose
    /// replaces the hand-eye.
    pub fn calibrations(&self, base_from_camera: Option<Rigid<Base, Camera>>) -> Rig {
        let quality = Quality {
            verdict: Verdict::Good,
            reasons: vec![TRUE_VALUES.into()],
            advice: vec![],
            figures: Default::default(),
            per_picture: vec![],
        };
        let none = |names: &[&str]| Covariance::new(names, &nalgebra::DMatrix::zeros(names.len(), names.len()));
        let camera = none(&NAMES[..ALWAYS_NAMED]);
        let plane = none(&["nx", "ny", "nz", "offset_mm"]);
        let pointer = none(&["ox_mm", "oy_mm", "oz_mm", "dx", "dy", "dz"]);
        let pose = none(&["tx_mm", "ty_mm", "tz_mm", "rx_rad", "ry_rad", "rz_rad"]);
        let mut camera = Calibration::new(Kind::Camera, self.camera, None, camera, quality.clone());
        let place = |i: usize| [i as u32 % self.camera.width, i as u32 / self.camera.width];
        camera.hot_pixels = self.hot_pixels().iter().map(|hot| place(hot.0)).collect();
        let with = Some(&camera);
        Rig {
            laser_plane: Some(Calibration::new(Kind::LaserPlane, self.laser.plane(), with, plane, quality.clone())),
            pointer: Some(Calibration::new(Kind::Pointer, self.pointer.ray(), with, pointer, quality.clone())),
            hand_eye: base_from_camera
                .is_none()
                .then(|| Calibration::new(Kind::HandEye, self.flange_from_camera, with, pose.clone(), quality.clone())),
            base_camera: base_from_camera.map(|x| Calibration::new(Kind::BaseCamera, x, with, pose, quality)),
            camera: Some(camera),
            ..Rig::default()
        }
    }

    /// An independent random stream for each purpose, so that adding one does not change the others.
    pub fn rng(&self, purpose: &str, index: u64) -> Pcg64 {
        let mut seed = self.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ index.wrapping_mul(0xd1b5_4a32_d192_ed03);
        for byte in purpose.bytes() {
            seed = (seed ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
        Pcg64::seed_from_u64(seed)
    }
}

/// The camera. `off` draws a value's deviation from the design, here and below.
fn camera(rig: &RigSpec, off: &mut impl FnMut(f64, f64) -> f64) -> Intrinsics {
    let c = &rig.camera;
    let (width, height) = (f64::from(c.width_px), f64::from(c.height_px));
    let f = off(rig.focal_px(), 30.0 / 611.6 * rig.focal_px());
    let [k1, k2, p1, p2, k3] = c.distortion;
    let [tau_x, tau_y] = c.sensor_tilt_deg.map(f64::to_radians);
    Intrinsics {
        fx: f,
        fy: f * off(1.0, 0.002),
        cx: off((width - 1.0) / 2.0, width / 80.0),
        cy: off((height - 1.0) / 2.0, height / 60.0),
        skew: 0.0,
        distortion: Distortion([
            off(k1, 3.0 / 11.0 * k1.abs()),
            off(k2, 3.0 / 8.0 * k2.abs()),
            off(p1, 8e-4),
            off(p2, 8e-4),
            off(k3, 2.0 / 3.0 * k3.abs()),
            0.0,
            0.0,
            0.0,
            0.0,
            0.0,
            0.0,
            0.0,
            tau_x,
            tau_y,
        ]),
        width: c.width_px,
        height: c.height_px,
    }
}

/// The sheet of light, and the depth at which it crosses the optical axis, mm: the design's values with deviations
/// from `off`. The source lies on the laser's side.
fn laser(rig: &RigSpec, off: &mut impl FnMut(f64, f64) -> f64) -> (LineLaser, f64) {
    let l = &rig.laser;
    let (baseline, angle) =
        (off(l.baseline_mm, 4.0 / 77.0 * l.baseline_mm), off(l.angle_deg, (l.angle_deg / 14.0).min(2.0)));
    let (angle, roll) = (angle.to_radians(), off(0.0, 1.5).to_radians());
    let crossing = rig.crossing();
    let crossing = off(crossing, 4.0 / 155.0 * crossing);
    let side = exp(&(Vec3::z() * (l.side_deg - 90.0).to_radians()));
    let source = side * Vec3::new(off(0.0, 3.0 / 77.0 * l.baseline_mm), baseline, crossing - baseline / angle.tan());
    let axis = side * Vec3::new(0.0, -angle.sin(), angle.cos());
    let normal = exp(&(axis * roll)) * (side * Vec3::new(0.0, angle.cos(), angle.sin()));
    let laser = LineLaser {
        source,
        axis,
        normal,
        half_fan_deg: l.fan_deg / 2.0,
        waist_radius: off(l.waist_radius_mm, 2.0 / 21.0 * l.waist_radius_mm),
        waist_distance: off(l.waist_at_mm, 8.0 / 170.0 * l.waist_at_mm),
        wavelength_nm: l.wavelength_nm,
    };
    (laser, crossing)
}

fn pointer(rig: &RigSpec, off: &mut impl FnMut(f64, f64) -> f64) -> Pointer {
    let p = rig.pointer_spec();
    let (wide, far) = (rig.board_scale(), rig.working.distance_mm / 155.0);
    let scales = [wide, wide, far];
    let mut near =
        |at: [f64; 3], by: [f64; 3]| Vec3::from(std::array::from_fn::<_, 3, _>(|i| off(at[i], by[i] * scales[i])));
    let (spot, aim) = (near(p.source_mm, [2.0, 3.0, 2.0]), near(p.aim_mm, [3.0, 2.0, 8.0]));
    Pointer {
        source: spot,
        axis: (aim - spot).normalize(),
        waist_radius: p.waist_radius_mm,
        waist_distance: p.waist_at_mm,
        wavelength_nm: p.wavelength_nm,
    }
}

fn mount(rig: &RigSpec, off: &mut impl FnMut(f64, f64) -> f64) -> HandEye {
    let m = &rig.mount;
    let quarter = off(m.turn_deg, 4.0).to_radians();
    let tilt = Vec3::new(off(0.0, 0.02), off(0.0, 0.02), 0.0);
    let [x, y, z] = m.at_mm;
    Rigid::new(exp(&tilt) * exp(&(Vec3::z() * quarter)), Vec3::new(off(x, 6.0), off(y, 5.0), off(z, 6.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sheet_crosses_the_axis_at_the_working_distance() {
        for seed in 0..50 {
            let s = Station::random(seed);
            let p = Ray::new(Vec3::zeros(), Vec3::z()).unwrap().meet(&s.laser.plane()).unwrap();
            // Roll turns the sheet about the fan's axis, which passes through x = source.x, not 0.
            assert!((p.z - s.working_distance).abs() < 0.5, "{} {}", p.z, s.working_distance);
            s.camera.check().unwrap();
            s.sensor.check().unwrap();
        }
        assert_ne!(Station::random(1).camera, Station::random(2).camera);
        assert_eq!(Station::random(3).camera, Station::random(3).camera);
    }

    #[test]
    fn a_stored_station_is_the_same_rig() {
        let dir = tempfile::tempdir().unwrap();
        let s = Station::random(7);
        s.store(dir.path()).unwrap();
        let rig = Rig::load(dir.path()).unwrap();
        assert_eq!(rig.need_camera().unwrap().value, s.camera);
        assert!(rig.need_laser_plane().unwrap().value.distance(&s.laser.source).abs() < 1e-9);
        assert!(rig.need_hand_eye().unwrap().value.difference(&s.flange_from_camera).1 < 1e-9);
    }
}
