//! In: a rig file (TOML): the design of a camera with a sheet of light on a robot. Out: the checked design, and the
//! lengths derived from it: pixel footprint, stripe length, distances of boards.
//! Frame and unit: camera frame, mm, degrees, px; each key shows its unit, docs/file-formats.md, Rig file.

use super::sensor::Sensor;
use crate::camera::{Distortion, Intrinsics};
use crate::fault::{Fault, Result};
use std::path::Path;

/// Field of the paper's rig at its working distance, mm: scenes and boards are stated for these lengths.
const PAPER_FIELD_MM: [f64; 2] = [162.2, 121.65];

/// Rounds to three significant digits, like sizes that people choose.
pub fn three_digits(x: f64) -> f64 {
    let unit = 10f64.powi(x.abs().max(1e-12).log10().floor() as i32 - 2);
    // Parsing the decimal text gives the exact literal; multiplying by the unit would leave the last bit off.
    format!("{:.12}", (x / unit).round() * unit).parse().expect("a number")
}

/// A design. [`super::Station`] is a specimen of it.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RigSpec {
    /// Name of the design; can be part of a file's name.
    pub name: String,
    /// Camera and lens.
    pub camera: CameraSpec,
    /// Conversion of light into grey levels; [`Sensor::default`] unless stated.
    #[serde(default)]
    pub sensor: Sensor,
    /// The sheet of light.
    pub laser: LaserSpec,
    /// Depths that it works at.
    pub working: WorkingSpec,
    /// Mount of the camera on the flange; [`MountSpec::default`] unless stated.
    #[serde(default)]
    pub mount: MountSpec,
    /// The pointer; if not stated, the default rig's, scaled with the working distance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pointer: Option<PointerSpec>,
}

/// A camera with its lens as designed.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraSpec {
    /// Columns of the sensor, px, 64..=8192.
    pub width_px: u32,
    /// Rows of the sensor, px, 64..=8192.
    pub height_px: u32,
    /// Edge of a pixel, 0.5..=50 µm.
    pub pixel_um: f64,
    /// Distance from the lens's projection centre to the sensor, 0.5..=2000 mm.
    pub focal_mm: f64,
    /// k1 k2 p1 p2 k3 in OpenCV's order, -1000..=1000 each; zeros unless stated.
    #[serde(rename = "distortion_k1_k2_p1_p2_k3", default)]
    pub distortion: [f64; 5],
    /// The sensor's tilt against the lens, OpenCV's tau_x and tau_y, -30..=30 degrees (Scheimpflug).
    #[serde(default)]
    pub sensor_tilt_deg: [f64; 2],
}

/// A line laser as designed: its pose and the spread of its sheet of light.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LaserSpec {
    /// Angle between the fan's middle and the optical axis, 3..=80 degrees.
    pub angle_deg: f64,
    /// Direction from the camera to the laser, as seen in the picture: 0 right, 90 below, 180 left, 270 above; the
    /// stripe runs across this direction. -360..=360.
    pub side_deg: f64,
    /// Distance of the laser's source from the optical axis, 1..=5000 mm.
    pub baseline_mm: f64,
    /// Depth at which the sheet crosses the optical axis, mm; the working distance unless stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crosses_axis_at_mm: Option<f64>,
    /// Full opening of the fan, 1..=120 degrees.
    pub fan_deg: f64,
    /// 1/e² radius across the sheet at its waist, 0.001..=20 mm ...
    pub waist_radius_mm: f64,
    /// ... which lies this far from the source, 1..=20000 mm.
    pub waist_at_mm: f64,
    /// Wavelength, 300..=1100 nm.
    pub wavelength_nm: f64,
}

/// Working volume of a design: depths along the camera's optical axis.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WorkingSpec {
    /// Camera depth of scans, 1..=20000 mm.
    pub distance_mm: f64,
    /// Nearest camera depth of boards and parts, mm; near <= distance <= far.
    pub near_mm: f64,
    /// Farthest camera depth of boards and parts, mm, up to 20000.
    pub far_mm: f64,
    /// Angle by which the camera leans away from the laser during a scan, -80..=80 degrees: at the laser's angle the
    /// sheet is upright. The sheet still meets the scene at the point where it met the axis.
    #[serde(default)]
    pub lean_deg: f64,
}

/// Pose of the camera on the flange.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MountSpec {
    /// Rotation about the optical axis, -360..=360 degrees.
    pub turn_deg: f64,
    /// Camera centre in the flange frame, -2000..=2000 mm each.
    pub at_mm: [f64; 3],
}

impl Default for MountSpec {
    fn default() -> Self {
        MountSpec { turn_deg: -91.0, at_mm: [-46.0, 1.0, 94.0] }
    }
}

/// A second laser, a round beam.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointerSpec {
    /// Point where the beam leaves, camera frame, mm.
    pub source_mm: [f64; 3],
    /// A point that the beam passes, camera frame, mm; its z is larger than the source's.
    pub aim_mm: [f64; 3],
    /// 1/e² radius at the waist, 0.001..=20 mm.
    pub waist_radius_mm: f64,
    /// Distance of the waist from the source, 1..=20000 mm.
    pub waist_at_mm: f64,
    /// Wavelength, 300..=1100 nm.
    pub wavelength_nm: f64,
    /// Nearest camera depth that it measures, mm.
    pub near_mm: f64,
    /// Farthest camera depth that it measures, mm, up to 20000.
    pub far_mm: f64,
}

impl RigSpec {
    /// The rig that is simulated if no other is named.
    pub fn paper() -> RigSpec {
        RigSpec::parse(include_str!("../../data/rigs/paper.toml")).expect("ships with the program")
    }

    /// Reads and checks a rig file.
    pub fn load(path: &Path) -> Result<RigSpec> {
        let text = crate::files::read_text(path)?;
        RigSpec::parse(&text).map_err(|e| e.at(path.display()))
    }

    /// Reads and checks a rig file's text.
    pub fn parse(text: &str) -> Result<RigSpec> {
        let rig: RigSpec = toml::from_str(text).map_err(|e| {
            Fault::input(format!("is not a rig file: {}", e.to_string().trim_end()))
                .cause(crate::files::slip_at(
                    text,
                    e.span().map_or(0, |s| s.start),
                    "a misspelt key, a missing size, or a value of the wrong type",
                ))
                .next("compare it with docs/file-formats.md, Rig file, or with data/rigs")
        })?;
        rig.check()?;
        Ok(rig)
    }

    /// Refuses values outside the ranges that the fields state.
    pub fn check(&self) -> Result<()> {
        crate::files::named("name", &self.name)?;
        self.sensor.check()?;
        let (c, l, w, m) = (&self.camera, &self.laser, &self.working, &self.mount);
        let mut limits = vec![
            ("camera.width_px", f64::from(c.width_px), 64.0, 8192.0),
            ("camera.height_px", f64::from(c.height_px), 64.0, 8192.0),
            ("camera.pixel_um", c.pixel_um, 0.5, 50.0),
            ("camera.focal_mm", c.focal_mm, 0.5, 2000.0),
            ("laser.angle_deg", l.angle_deg, 3.0, 80.0),
            ("laser.side_deg", l.side_deg, -360.0, 360.0),
            ("laser.baseline_mm", l.baseline_mm, 1.0, 5000.0),
            ("laser.crosses_axis_at_mm", self.crossing(), 1.0, 20_000.0),
            ("laser.fan_deg", l.fan_deg, 1.0, 120.0),
            ("laser.waist_radius_mm", l.waist_radius_mm, 0.001, 20.0),
            ("laser.waist_at_mm", l.waist_at_mm, 1.0, 20_000.0),
            ("laser.wavelength_nm", l.wavelength_nm, 300.0, 1100.0),
            ("working.distance_mm", w.distance_mm, 1.0, 20_000.0),
            ("working.near_mm", w.near_mm, 0.5, w.distance_mm),
            ("working.far_mm", w.far_mm, w.distance_mm.max(w.near_mm * 1.001), 20_000.0),
            ("working.lean_deg", w.lean_deg, -80.0, 80.0),
            ("mount.turn_deg", m.turn_deg, -360.0, 360.0),
        ];
        limits.extend(m.at_mm.iter().map(|v| ("mount.at_mm", *v, -2000.0, 2000.0)));
        limits.extend(c.distortion.iter().map(|v| ("camera.distortion_k1_k2_p1_p2_k3", *v, -1e3, 1e3)));
        limits.extend(c.sensor_tilt_deg.iter().map(|v| ("camera.sensor_tilt_deg", *v, -30.0, 30.0)));
        if let Some(p) = &self.pointer {
            limits.extend([
                ("pointer.waist_radius_mm", p.waist_radius_mm, 0.001, 20.0),
                ("pointer.waist_at_mm", p.waist_at_mm, 1.0, 20_000.0),
                ("pointer.wavelength_nm", p.wavelength_nm, 300.0, 1100.0),
                ("pointer.near_mm", p.near_mm, 0.5, 20_000.0),
                ("pointer.far_mm", p.far_mm, p.near_mm * 1.001, 20_000.0),
                ("pointer.aim_mm z", p.aim_mm[2], p.source_mm[2] + 1e-3, 20_000.0),
            ]);
        }
        match limits.iter().find(|(_, v, low, high)| !(*low..=*high).contains(v)) {
            Some((name, v, low, high)) => Err(Fault::input(format!("{name} is {v}, allowed {low}..={high}"))
                .cause("a slip in the rig file, or another unit than the key names")
                .next("correct the value")),
            None => self.folds(),
        }
    }

    /// Refuses a lens that cannot be inverted over the picture.
    fn folds(&self) -> Result<()> {
        let c = &self.camera;
        let mut distortion = Distortion::from(c.distortion);
        [distortion.0[12], distortion.0[13]] = c.sensor_tilt_deg.map(f64::to_radians);
        let middle = |n: u32| (f64::from(n) - 1.0) / 2.0;
        let (f, cx, cy) = (self.focal_px(), middle(c.width_px), middle(c.height_px));
        let camera = Intrinsics { fx: f, fy: f, cx, cy, skew: 0.0, distortion, width: c.width_px, height: c.height_px };
        camera.fold().map_or(Ok(()), |at| {
            let far = (at.x - cx).hypot(at.y - cy);
            Err(Fault::input(format!("camera.distortion_k1_k2_p1_p2_k3 folds back {far:.0} px from the middle"))
                .cause("a slip in the rig file: beyond that no point of the scene comes into the picture")
                .next("correct the terms, or state a smaller picture"))
        })
    }

    /// Focal length of the design, px.
    pub fn focal_px(&self) -> f64 {
        self.camera.focal_mm / (self.camera.pixel_um * 1e-3)
    }
    /// Depth at which the sheet crosses the optical axis, mm.
    pub fn crossing(&self) -> f64 {
        self.laser.crosses_axis_at_mm.unwrap_or(self.working.distance_mm)
    }
    /// Size that a pixel covers at the working distance, mm.
    pub fn footprint_mm(&self) -> f64 {
        self.working.distance_mm / self.focal_px()
    }
    /// The picture's two sides at the working distance, mm, without the lens's distortion.
    pub fn field_mm(&self) -> [f64; 2] {
        [self.camera.width_px, self.camera.height_px].map(|n| f64::from(n) * self.footprint_mm())
    }
    /// The pointer. If the file states none, it is the default rig's: its offset from the camera scales with the
    /// field, its depths scale with the distance.
    pub fn pointer_spec(&self) -> PointerSpec {
        let (far, wide) = (self.working.distance_mm / 155.0, self.board_scale());
        self.pointer.unwrap_or(PointerSpec {
            source_mm: [41.0 * wide, 9.0 * wide, 12.0 * far],
            aim_mm: [0.0, 3.0 * wide, 190.0 * far],
            waist_radius_mm: 0.5 * wide,
            waist_at_mm: 143.0 * far,
            wavelength_nm: 650.0,
            near_mm: self.working.near_mm,
            far_mm: self.working.far_mm,
        })
    }
    /// Length of the stripe through the middle at the working distance, limited by picture and fan, mm.
    pub fn stripe_mm(&self) -> f64 {
        let (s, c) = self.laser.side_deg.to_radians().sin_cos();
        let [w, h] = self.field_mm();
        let range = self.laser.baseline_mm / self.laser.angle_deg.to_radians().sin();
        let fan = 2.0 * range * (self.laser.fan_deg.to_radians() / 2.0).tan();
        // The stripe runs along (-s, c).
        (w / s.abs().max(1e-9)).min(h / c.abs().max(1e-9)).min(fan)
    }
    /// Ratio of the scene's lengths to those that the paper's rig sees, to three digits.
    pub fn scale(&self) -> f64 {
        three_digits(self.stripe_mm() / PAPER_FIELD_MM[0])
    }
    /// The same ratio for boards, which have to fit into the picture completely.
    pub fn board_scale(&self) -> f64 {
        let [w, h] = self.field_mm();
        three_digits((w.max(h) / PAPER_FIELD_MM[0]).min(w.min(h) / PAPER_FIELD_MM[1]))
    }
    /// Distances of boards for the range `wanted` (shares of `distance`), clamped to the working volume.
    pub fn board_distances(&self, wanted: [f64; 2], distance: f64) -> [f64; 2] {
        let (low, high) = (self.working.near_mm, self.working.far_mm);
        let near = (wanted[0] * distance).clamp(low, (low + high) / 2.0);
        [near, (wanted[1] * distance).clamp(near, high)]
    }
    /// Number of shots for steps of one and a half pixel footprints over a length.
    pub fn shots_over(&self, length_mm: f64) -> usize {
        (length_mm / (1.5 * self.footprint_mm())).ceil().max(2.0) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAPER: &str = include_str!("../../data/rigs/paper.toml");

    #[test]
    fn a_rig_file_is_checked_key_by_key() {
        let rig = RigSpec::paper();
        assert!((rig.focal_px() - 611.6).abs() < 1e-9 && (rig.scale() - 1.0).abs() < 1e-12, "{}", rig.scale());
        assert!(RigSpec::parse(&PAPER.replace("fan_deg", "fan")).unwrap_err().what.contains("fan"));
        for (from, to, says) in [
            ("angle_deg = 28", "angle_deg = 95", "laser.angle_deg is 95"),
            ("near_mm = 60", "near_mm = 160", "working.near_mm is 160"),
            ("bits = 8", "bits = 24", "bits is 24"),
            ("focal_mm = 5.07628", "focal_mm = nan", "camera.focal_mm is NaN"),
            ("k3 = [-0.11, 0.08", "k3 = [-1.5, 0", "folds back 192 px"),
        ] {
            let text = PAPER.replacen(from, to, 1);
            assert_ne!(text, PAPER, "{from}");
            assert!(RigSpec::parse(&text).unwrap_err().what.contains(says), "{to}");
        }
    }

    #[test]
    fn the_stripe_is_as_long_as_picture_and_fan_let_it_be() {
        let mut rig = RigSpec::paper();
        let [w, h] = rig.field_mm();
        assert!((rig.stripe_mm() - w).abs() < 1e-9);
        rig.laser.side_deg = 180.0;
        assert!((rig.stripe_mm() - h).abs() < 1e-6);
        rig.laser.side_deg = 45.0;
        assert!((rig.stripe_mm() - h * 2f64.sqrt()).abs() < 1e-6);
        rig.laser.fan_deg = 20.0;
        let range = 77.0 / 28f64.to_radians().sin();
        assert!((rig.stripe_mm() - 2.0 * range * 10f64.to_radians().tan()).abs() < 1e-9);
    }
}
