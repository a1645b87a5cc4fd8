//! In: a simulated station over a scene, how it moves and what the robot says of that. Out: the scan of it, as `scan`
//! makes it, and where its first part stood.
//! Frame and unit: base frame, mm, degrees.

use rand_pcg::Pcg64;
use sheetlight::geometry::{Base, Part, Rigid};
use sheetlight::recording::{Motion, Stand};
use sheetlight::rig::{Rig, Volume};
use sheetlight::scan::{Carrier, CloudPoint, Extraction, Format, Processor, Profile, Scanner, Shot, Shots};
use sheetlight::simulate::{
    Canvas, InScene, Scene, Sensor, Station, View, above, base_from_scene, expose, flange, part_pose, reported,
};

/// The usual sensor with its noise so many times as large, and no hot pixels.
pub fn noisy(noise: f64) -> Sensor {
    let s = Sensor::default();
    Sensor {
        read_noise_e: s.read_noise_e * noise,
        speckle: s.speckle * noise,
        full_well_e: s.full_well_e / noise.powi(2),
        hot_per_million: 0.0,
        ..s
    }
}

/// A scan along the scene's y.
pub struct Way {
    /// First and last place, and from shot to shot, mm.
    pub from: f64,
    pub to: f64,
    pub pitch: f64,
    /// Camera depths that are believed, mm.
    pub depths: [f64; 2],
    /// What reported poses scatter by, mm and degrees.
    pub pose_mm: f64,
    pub pose_deg: f64,
}

/// What is known after a scan.
pub struct Scan {
    pub cloud: Vec<CloudPoint>,
    pub shots: Shots,
    pub rig: Rig,
    pub base_from_part: Rigid<Base, Part>,
}

/// Simulates and scans it shot by shot.
pub fn scanned(station: &Station, scene: &Scene, way: &Way, rng: &mut Pcg64) -> Scan {
    let folder = tempfile::tempdir().unwrap();
    station.store(folder.path()).unwrap();
    let rig = Rig::load(folder.path()).unwrap();
    let base_from_scene = base_from_scene(station);
    let format = Format { width: station.camera.width, height: station.camera.height, bits: 8 };
    let volume = Volume::new(way.depths[0], way.depths[1], "test");
    let carrier = Carrier::new(&rig, &Motion::default()).unwrap();
    let mut scanner =
        Scanner::new(&rig, carrier, format, &Extraction::default(), Some(&volume), None, Processor::host()).unwrap();
    let height = scene.spec.focus_height_mm + station.working_distance;
    let (mut cloud, mut places): (Vec<CloudPoint>, Vec<_>) = Default::default();
    let mut take = |profiles: Vec<Profile>| {
        for p in profiles {
            places.push((p.shot, p.from_camera));
            cloud.extend(p.points);
        }
    };
    for i in 0..((way.to - way.from) / way.pitch) as u32 {
        let scene_from_camera = above(0.0, way.from + way.pitch * f64::from(i), height);
        let view = View { station, scene, scene_from_camera };
        let mut light = Canvas::new(format.width, format.height);
        view.sheet(&mut light);
        let dark = Canvas::new(format.width, format.height);
        let image = expose(&station.sensor, &light, &dark, 0.0, &[], rng);
        let pose = flange(station, &(base_from_scene * scene_from_camera));
        let stand = Stand::Robot(reported(&pose, way.pose_mm, way.pose_deg, rng));
        scanner.push(Shot { index: i, name: String::new(), image, stand, slip: None, here_ns: None }).unwrap();
        take(scanner.ready().unwrap());
    }
    take(scanner.finish().unwrap());
    let shots = Shots::new(scanner.stripe_along(), places);
    Scan { cloud, shots, rig, base_from_part: base_from_scene * part_pose::<InScene>(&scene.spec.part[0]) }
}
