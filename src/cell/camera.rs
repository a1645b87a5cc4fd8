//! In: the cell at a moment. Out: the picture that the camera on the flange takes, or the small one in the gripper.
//! Frame and unit: grey levels of the sensor's depth; s of the cell. A picture shows the middle of its exposure,
//! unmoved.

use crate::geometry::{Camera, Flange, Rigid, Vec3};
use crate::raster::Image;
use crate::simulate::{Canvas, InScene, Scene, Sensor, Station, View, expose};

/// Rays a pixel's side of pictures in room light.
const RAYS: u32 = 2;
/// The gripper's camera looks from beside the fingers at what is below the tool, mm before the tool's origin.
const GRIPPER_ABOVE_MM: f64 = 60.0;

/// What was lit at the moment of a picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lit {
    pub line: bool,
    pub pointer: bool,
    pub room: bool,
}

/// One picture. `number` keeps its noise apart from others'.
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

/// The small camera in the gripper: looks along the tool's way, quarter of the large one's width.
pub(super) fn gripper_station(of: &Station, flange_from_tool: &Rigid<Flange, crate::geometry::Tool>) -> Station {
    let mut station = of.clone();
    let width = (of.camera.width / 2).max(160);
    let height = (of.camera.height / 2).max(120);
    station = station.with_size(width, height);
    // The camera's z goes into what it looks at, the tool's z comes out of it.
    let turn = crate::geometry::Mat3::from_diagonal(&Vec3::new(1.0, -1.0, -1.0));
    let tool_from_camera: Rigid<crate::geometry::Tool, Camera> =
        Rigid::new(turn, Vec3::new(0.0, -18.0, GRIPPER_ABOVE_MM));
    station.flange_from_camera = *flange_from_tool * tool_from_camera;
    station
}
