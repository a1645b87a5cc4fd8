//! What the flange of a station's robot carries, from the station's files; flange frame, mm.

use crate::arm::rules::Carried;
use crate::fault::Result;
use crate::geometry::{Camera, Ray, Vec3};
use crate::rig::Rig;
use crate::station::settings::Settings;

/// Tool and sensor head as station.toml states them. If it states no head, two points come from the calibration:
/// the camera's centre, and the point where the pointer's beam crosses the plane through it. A rig that cannot be
/// read describes nothing, and the reason is shown with every motion.
pub fn carried(settings: &Settings, rig: &Result<Rig>) -> Carried {
    let tool = settings.tool.map(|t| t.flange_from_tool.translation);
    let stated = settings.head.as_ref().map(|h| h.points_mm.iter().map(|p| Vec3::from(*p)).collect());
    let head = stated.map_or_else(|| rig.as_ref().map_err(|e| e.what.clone()).and_then(measured), Ok);
    Carried::new(tool, head)
}

fn measured(rig: &Rig) -> std::result::Result<Vec<Vec3>, String> {
    let Some(hand_eye) = &rig.hand_eye else {
        return match rig.base_camera {
            Some(_) => Ok(Vec::new()),
            None => Err("station.toml has no [head], and there is no hand-eye calibration".into()),
        };
    };
    let beam = rig.pointer.as_ref().and_then(|p| leaves(&p.value));
    let seen = [Vec3::zeros()].into_iter().chain(beam);
    Ok(seen.map(|p| hand_eye.value.point(&p)).collect())
}

/// The point where a beam crosses the plane through the camera's centre normal to its axis: about the beam's
/// source.
fn leaves(beam: &Ray<Camera>) -> Option<Vec3> {
    let p = beam.at(-beam.origin.z / beam.direction.z);
    p.iter().all(|x| x.is_finite()).then_some(p)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fault::Fault;
    use crate::geometry::{Base, Rigid};
    use crate::simulate::Station;
    use crate::station::settings::{HeadSpec, ToolSpec};

    #[test]
    fn the_head_is_where_it_is_stated_else_where_it_was_measured() {
        let station = Station::random(3);
        let rig = |still: Option<Rigid<Base, Camera>>| Ok(station.calibrations(still));
        let lever = |s: &Settings, r: &Result<Rig>| carried(s, r).lever_mm();
        let settings = Settings::default();
        let (known, n) = (carried(&settings, &rig(None)), station.flange_from_camera.translation.norm());
        assert_eq!((known.points().count(), known.unknown().len()), (3, 1), "no tool: {:?}", known.unknown());
        assert!(lever(&settings, &rig(None)) >= n);
        // The beam's source lies on the beam, in the camera's plane.
        let source = station.flange_from_camera.inverse().point(known.points().last().unwrap());
        let beam = station.pointer.ray();
        assert!(source.z.abs() < 1e-9 && (source - beam.origin).cross(&beam.direction).norm() < 1e-6);
        let stated = Settings { head: Some(HeadSpec { points_mm: vec![[0.0, 300.0, 0.0]] }), ..Settings::default() };
        assert_eq!(lever(&stated, &rig(None)), 300.0);
        let mut still = rig(Some(Rigid::identity())).unwrap();
        still.hand_eye = None;
        let still = carried(&settings, &Ok(still));
        assert_eq!((still.points().count(), still.unknown().len()), (1, 1));
        let tool = ToolSpec { flange_from_tool: Rigid::from_vectors(&Vec3::zeros(), Vec3::new(0.0, 0.0, 160.0)) };
        let bare = carried(&Settings { tool: Some(tool), ..Settings::default() }, &Ok(Rig::default()));
        assert_eq!(bare.lever_mm(), 160.0);
        assert!(bare.unknown().len() == 1 && bare.unknown()[0].contains("hand-eye"), "{:?}", bare.unknown());
        let spoilt = carried(&settings, &Err(Fault::input("hand_eye.json is cut off")));
        assert!(spoilt.unknown()[1].contains("cut off"), "{:?}", spoilt.unknown());
    }
}
