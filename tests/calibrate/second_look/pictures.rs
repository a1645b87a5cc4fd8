//! In: a station before a scene and where its camera stands at each shot. Out: the peaks that the engine finds in the
//! pictures, which are rendered without noise: a draw adds its own. Frame and unit: scene frame, mm; px, grey levels.

use rand_pcg::Pcg64;
use rayon::prelude::*;
use sheetlight::geometry::{Base, Camera, Rigid, Vec2};
use sheetlight::raster::Image;
use sheetlight::recording::{Motion, Stand};
use sheetlight::rig::{Rig, Volume};
use sheetlight::scan::{Carrier, Extraction, Format, Processor, Scanner, Shot};
use sheetlight::simulate::{Canvas, InScene, Scene, Sensor, Station, View, expose, flange};

/// A peak: where it is seen, and its height in grey levels.
#[derive(Clone, Copy)]
pub struct Peak {
    pub px: Vec2,
    pub light: f64,
}

/// Peaks of a look, by shot. `reach`: tangent of half the fan, a wider one would light what nobody looks at.
pub fn peaks(
    station: &Station,
    scene: &Scene,
    base_from_scene: &Rigid<Base, InScene>,
    path: &[Rigid<InScene, Camera>],
    reach: f64,
) -> Vec<Vec<Peak>> {
    let mut station = station.clone();
    let sensor = station.sensor;
    station.sensor = Sensor { read_noise_e: 0.0, full_well_e: 1e6, speckle: 0.0, hot_per_million: 0.0, ..sensor };
    station.laser.half_fan_deg = station.laser.half_fan_deg.min(reach.atan().to_degrees());
    let images: Vec<Image> =
        path.par_iter().enumerate().map(|(i, at)| pictured(&station, scene, at, i as u64)).collect();
    let folder = tempfile::tempdir().unwrap();
    station.store(folder.path()).unwrap();
    let rig = Rig::load(folder.path()).unwrap();
    let format = Format { width: station.camera.width, height: station.camera.height, bits: sensor.bits };
    // A specimen works where its own sheet crosses the axis.
    let own = station.working_distance / station.rig.working.distance_mm;
    let (near, far) = (station.rig.working.near_mm * own, station.rig.working.far_mm * own);
    let (carrier, volume) =
        (Carrier::new(&rig, &Motion::default()).unwrap(), Volume::new(near, far, "the rig's design"));
    let mut scanner =
        Scanner::new(&rig, carrier, format, &Extraction::default(), Some(&volume), None, Processor::host()).unwrap();
    let mut shots = vec![vec![]; path.len()];
    let mut take = |points: Vec<sheetlight::scan::Profile>| {
        for p in points.into_iter().flat_map(|p| p.points) {
            let px = Vec2::new(f64::from(p.u), f64::from(p.v));
            shots[p.shot as usize].push(Peak { px, light: f64::from(p.intensity) });
        }
    };
    for (i, (at, image)) in path.iter().zip(images).enumerate() {
        let stand = Stand::Robot(flange(&station, &(*base_from_scene * *at)));
        let shot = Shot { index: i as u32, name: String::new(), image, stand, slip: None, here_ns: None };
        scanner.push(shot).unwrap();
        take(scanner.ready().unwrap());
    }
    take(scanner.finish().unwrap());
    shots
}

fn pictured(station: &Station, scene: &Scene, scene_from_camera: &Rigid<InScene, Camera>, shot: u64) -> Image {
    let (w, h) = (station.camera.width, station.camera.height);
    let mut light = Canvas::new(w, h);
    View { station, scene, scene_from_camera: *scene_from_camera }.sheet(&mut light);
    let mut rng: Pcg64 = station.rng("picture", shot);
    expose(&station.sensor, &light, &Canvas::new(w, h), 0.0, &[], &mut rng)
}
