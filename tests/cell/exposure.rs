//! How long the simulated camera exposes: as it was set, over its wire, and as tuning finds it.

use super::workplace::{Set, scene, set_but};
use sheetlight::arm::{Outputs, Switchboard};
use sheetlight::capture::source::cell::CellCamera;
use sheetlight::capture::{Event, PictureSource, WANTED, fresh, tune};
use sheetlight::recording::Beam;
use sheetlight::simulate::{Material, ShapeSpec, SolidSpec};
use std::time::Duration;

/// A cell with a white matte plate before the sensor: nothing on it glints.
fn white() -> Set {
    set_but(scene("osc", 3), 3, 2.0, |spec| {
        let (shape, material) =
            (ShapeSpec::Block { size_mm: [300.0, 300.0, 2.0] }, Material { albedo: 0.9, ..Material::default() });
        let at_mm = [spec.part[0].at_mm[0], spec.part[0].at_mm[1], 0.0];
        spec.part.clear();
        spec.solid =
            vec![SolidSpec { shape, at_mm, turn_deg: 0.0, material, cut: vec![], repeat: [1, 1], pitch_mm: [0.0; 2] }];
    })
}

fn camera(set: &Set, rate_hz: f64) -> CellCamera {
    CellCamera::open(&set.served.camera.to_string(), rate_hz).unwrap()
}

/// The sum of all levels of a picture that is taken now.
fn light(camera: &mut CellCamera) -> f64 {
    let image = fresh(camera, Duration::from_secs(60)).unwrap();
    image.to_f32().iter().map(|level| f64::from(*level)).sum()
}

#[test]
fn tuning_finds_the_exposure_and_the_camera_keeps_it() {
    let set = white();
    let arm = sheetlight::arm::open(&set.served.robot_uri()).unwrap();
    // Pictures at the camera's own pace, and those that are asked for one by one.
    for (rate_hz, from) in [(50.0, "40"), (-1.0, "9000")] {
        let mut camera = camera(&set, rate_hz);
        camera.set("ExposureTime", from).unwrap();
        let mut lights = Switchboard::of(&*arm, Outputs::default()).unwrap();
        lights.lamp(false).unwrap();
        let mut tries = 0;
        let tuned = lights.lit(Beam::Line, || tune(&mut camera, |_, _| tries += 1)).unwrap();
        let peak = tuned.look.stripe.unwrap().peak;
        println!("from {from} us: {:.0} us after {tries} tries, peak {peak:.2}", tuned.exposure_us);
        // The sensor's hot pixels saturate first here: tuning settles below that, and says so.
        let settled = tuned.remark.is_some() && (0.5..WANTED[0]).contains(&peak);
        assert!(((WANTED[0]..=WANTED[1]).contains(&peak) || settled) && tries > 1, "{peak} {:?}", tuned.remark);
        assert!((100.0..5000.0).contains(&tuned.exposure_us), "{} us", tuned.exposure_us);
        // Whoever connects next finds it, and says it of every picture.
        let mut next = self::camera(&set, -1.0);
        let features = next.features().unwrap();
        let kept = &features.iter().find(|f| f.name == "ExposureTime").unwrap().value;
        assert_eq!(kept.as_ref().unwrap().to_string(), tuned.exposure_us.to_string());
        next.snap().unwrap();
        let Event::Picture(picture) = next.next(Duration::from_secs(60)) else { panic!("no picture") };
        assert_eq!(picture.exposure_ns, Some((1e3 * tuned.exposure_us).round() as u64));
    }
}

#[test]
fn light_goes_with_the_exposure_and_what_cannot_be_set_is_refused() {
    let set = white();
    let mut camera = camera(&set, -1.0);
    let mut at = |us: &str| {
        camera.set("ExposureTime", us).unwrap();
        light(&mut camera)
    };
    // In room light that is far from full scale.
    let (short, long) = (at("200"), at("400"));
    assert!((long / short - 2.0).abs() < 0.03, "{short} {long}");
    for wrong in ["1", "1e6", "long"] {
        let fault = camera.set("ExposureTime", wrong).unwrap_err();
        assert!(fault.what.contains("ExposureTime 20 to 10000 us"), "{fault}");
    }
}
