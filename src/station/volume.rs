//! In: station.toml, the calibrations of a rig, values from the command line. Out: the depths in which points are
//! accepted and those at which calibrations are judged, each with its origin.
//! Frame and unit: along the camera's optical axis, mm.

use super::Settings;
use crate::calibrate::limits::Asked;
use crate::fault::{Fault, Result};
use crate::rig::{Rig, Volume};

/// Depths in which boards determined the laser plane; `None` for an imported one.
pub fn calibrated(rig: &Rig) -> Option<Volume> {
    let figures = &rig.laser_plane.as_ref()?.quality.figures;
    let at = |name: &str| figures.get(name).copied().filter(|z| *z > 0.0);
    let (near, far) = (at("nearest_board_mm")?, at("farthest_board_mm")?);
    (near < far).then(|| Volume::new(near, far, "where the laser plane's boards stood"))
}

/// Depths at which a scan's points are accepted: those that station.toml states, else those of the laser plane's
/// boards, extended ([`Volume::extended`]). `None`: unknown, every depth is accepted.
pub fn believed(settings: &Settings, rig: &Rig) -> Option<Volume> {
    settings.volume().or_else(|| calibrated(rig).map(|v| v.extended()))
}

/// Depths of the square view of a surface: the working volume, else the depth where the sheet meets the camera's
/// axis.
pub fn view(settings: &Settings, rig: &Rig) -> Result<Volume> {
    if let Some(v) = settings.volume().or_else(|| calibrated(rig)) {
        return Ok(v);
    }
    let plane = rig.need_laser_plane()?.value;
    let z = plane.offset / plane.normal.z;
    if !(z > 0.0 && z.is_finite()) {
        return Err(Fault::usage("the distance of the square view is unknown")
            .cause("the sheet does not meet the camera's axis in front of it, and no working volume is stated")
            .next("state the distance with --view-mm, or [working_volume] in station.toml"));
    }
    Ok(Volume::new(z, z, "where the sheet meets the camera's axis"))
}

/// The stated values for judging a calibration: from the command line, else from station.toml.
pub fn asked(settings: &Settings, stated: Option<[f64; 2]>) -> Asked {
    let working = stated.map(|[near, far]| Volume::new(near, far, "stated")).or_else(|| settings.volume());
    Asked { working, tolerance_mm: settings.tolerance_mm }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Camera, Plane, Vec3};
    use crate::rig::{Calibration, Covariance, Kind, Quality, Verdict};

    #[test]
    fn the_station_is_asked_first_then_the_laser_planes_boards() {
        let mut rig = Rig::default();
        let mut settings = Settings::default();
        assert_eq!(believed(&settings, &rig), None);
        let quality = |figures: &[(&str, f64)]| Quality {
            verdict: Verdict::Good,
            reasons: vec![],
            advice: vec![],
            figures: figures.iter().map(|(k, v)| (k.to_string(), *v)).collect(),
            per_picture: vec![],
        };
        let plane = |q| {
            let plane = Plane::<Camera>::new(Vec3::new(0.0, 0.9, 0.4), 200.0).unwrap();
            Some(Calibration::new(Kind::LaserPlane, plane, None, Covariance::default(), q))
        };
        rig.laser_plane = plane(quality(&[]));
        assert_eq!(believed(&settings, &rig), None, "an imported plane says nothing of depths");
        assert!((view(&settings, &rig).unwrap().middle() - 200.0 / 0.4).abs() < 1e-9);
        rig.laser_plane = plane(quality(&[("nearest_board_mm", 411.0), ("farthest_board_mm", 504.0)]));
        let v = believed(&settings, &rig).unwrap();
        assert_eq!((v.near_mm, v.far_mm), (318.0, 597.0));
        settings.working_volume = Some(super::super::WorkingVolume { near_mm: 400.0, far_mm: 500.0 });
        let v = believed(&settings, &rig).unwrap();
        assert_eq!((v.near_mm, v.far_mm, v.from.as_str()), (400.0, 500.0, "station.toml"));
        assert_eq!(asked(&settings, None).working.unwrap().from, "station.toml");
        assert_eq!(asked(&settings, Some([1.0, 2.0])).working.unwrap().from, "stated");
    }
}
