//! Pictures of the cell's two cameras: the sensor's, and the small one in the gripper. Grey levels have the
//! sensor's bit depth; exposures are in us. A picture shows the middle of its exposure, without motion blur.

use sheetlight::geometry::{Camera, Flange, Rigid, Vec3};
use sheetlight::raster::Image;
use sheetlight::simulate::{Canvas, InScene, Scene, Sensor, Station, View, expose};
use std::sync::{Mutex, PoisonError};

/// Rays along one side of a pixel, for pictures in room light.
const RAYS: u32 = 2;
/// Height of the gripper's camera above the tool's origin, mm. It looks past the fingers at what is below the tool.
const GRIPPER_ABOVE_MM: f64 = 60.0;

/// Exposure time that the levels of [`Sensor`] are stated for, and the initial setting of a camera, us.
pub(super) const EXPOSURE_US: f64 = 1000.0;
/// Range of exposure times, us.
pub(super) const EXPOSURES_US: [f64; 2] = [20.0, 10_000.0];

/// A camera's exposure setting. It persists as in a real camera: the next client finds it unchanged.
pub(super) struct Exposure(Mutex<f64>);

impl Exposure {
    pub fn us(&self) -> f64 {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sets the exposure. Returns false if it is out of range.
    pub fn set(&self, us: f64) -> bool {
        let can = (EXPOSURES_US[0]..=EXPOSURES_US[1]).contains(&us);
        if can {
            *self.0.lock().unwrap_or_else(PoisonError::into_inner) = us;
        }
        can
    }
}

impl Default for Exposure {
    fn default() -> Exposure {
        Exposure(Mutex::new(EXPOSURE_US))
    }
}

/// The lights that were on at the moment of a picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lit {
    pub line: bool,
    pub pointer: bool,
    pub room: bool,
}

/// The same camera and its hot pixels at the current exposure setting.
pub(super) fn exposed(of: &Station, hot: &[(usize, f32)], exposure: &Exposure) -> (Station, Vec<(usize, f32)>) {
    let times = exposure.us() / EXPOSURE_US;
    let station = Station { sensor: of.sensor.exposed(times), ..of.clone() };
    (station, hot.iter().map(|(place, extra)| (*place, extra * times as f32)).collect())
}

/// One picture. `number` seeds its noise, so that each picture has different noise.
pub(super) fn picture(
    station: &Station,
    scene: &Scene,
    hot: &[(usize, f32)],
    scene_from_camera: Rigid<InScene, Camera>,
    lit: Lit,
    number: u64,
) -> Image {
    let view = View { station, scene, scene_from_camera };
    let (w, h) = (station.camera.width, station.camera.height);
    let mut laser = Canvas::new(w, h);
    if lit.line {
        view.sheet(&mut laser);
    }
    if lit.pointer {
        view.spot(&mut laser);
    }
    let Sensor { ambient_white, ambient_leak, .. } = station.sensor;
    let (room, gain) = match (lit.room, ambient_leak > 0.0) {
        (true, _) => (view.ambient(if w > 1600 { 1 } else { RAYS }), ambient_white),
        (false, true) => (view.faint_ambient(), ambient_leak),
        (false, false) => (Canvas::new(w, h), 0.0),
    };
    let mut rng = station.rng("cell picture", number);
    expose(&station.sensor, &laser, &room, gain as f32, hot, &mut rng)
}

/// The small camera in the gripper: looks along the tool's axis, with half the large camera's width and height.
pub(super) fn gripper_station(of: &Station, flange_from_tool: &Rigid<Flange, sheetlight::geometry::Tool>) -> Station {
    let mut station = of.clone();
    let width = (of.camera.width / 2).max(160);
    let height = (of.camera.height / 2).max(120);
    station = station.with_size(width, height);
    // The camera's z axis points into the scene, the tool's z axis points out of it.
    let turn = sheetlight::geometry::Mat3::from_diagonal(&Vec3::new(1.0, -1.0, -1.0));
    let tool_from_camera: Rigid<sheetlight::geometry::Tool, Camera> =
        Rigid::new(turn, Vec3::new(0.0, -18.0, GRIPPER_ABOVE_MM));
    station.flange_from_camera = *flange_from_tool * tool_from_camera;
    station
}
