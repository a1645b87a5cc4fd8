//! In: a station, a scene or board, a seed. Out: the robot's pose for each picture of a recording.
//! Frame and unit: base, flange, camera, board, scene; mm. Every pose is reproducible from the seed.

use super::light::InScene;
use super::pattern::Pattern;
use super::scene::Scene;
use super::station::Station;
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Board, Camera, Flange, Mat3, Plane, Ray, Rigid, Vec2, Vec3, exp};
use crate::recording::{Beam, BoardSpec};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// Pose of the scene before the robot: turned by up to 15 degrees, tilted by up to 2.
pub fn base_from_scene(station: &Station) -> Rigid<Base, InScene> {
    let mut rng = station.rng("base_from_scene", 0);
    let mut within = |by: f64| rng.random_range(-by..by);
    let turn = exp(&Vec3::new(0.0, 0.0, within(0.26)));
    let tilt = exp(&Vec3::new(within(0.035), within(0.035), 0.0));
    Rigid::new(tilt * turn, Vec3::new(460.0 + within(30.0), -100.0 + within(30.0), 65.0 + within(20.0)))
}

/// Camera above a point of the scene, looking straight down, image x along the scene's x.
pub fn above(x: f64, y: f64, z: f64) -> Rigid<InScene, Camera> {
    Rigid::new(Mat3::from_diagonal(&Vec3::new(1.0, -1.0, -1.0)), Vec3::new(x, y, z))
}

/// A straight pass over the scene's region along y in equal steps, starting on the laser's side. The sheet meets the
/// scene's focus height at the working distance. The pass is longer than the region by the shift that the heights
/// cause.
pub fn scan(station: &Station, scene: &Scene, shots: usize) -> Vec<Rigid<InScene, Camera>> {
    let [x0, y0, x1, y1] = scene.spec.region_mm;
    let (rig, laser) = (&station.rig, &station.laser);
    let side = rig.laser.side_deg.to_radians();
    let turn = exp(&(Vec3::z() * (90f64.to_radians() - side)));
    let lean = exp(&(Vec3::x() * -rig.working.lean_deg.to_radians()));
    let rotation = lean * Mat3::from_diagonal(&Vec3::new(1.0, -1.0, -1.0)) * turn;
    // Position of the fan's middle at the working distance, measured towards the laser; it is on the axis unless the
    // rig states otherwise.
    let z = station.working_distance;
    let along = (laser.source + laser.axis * ((z - laser.source.z) / laser.axis.z))
        .xy()
        .dot(&Vec2::new(side.cos(), side.sin()));
    let met = rotation * Vec3::new(along * side.cos(), along * side.sin(), z);
    let over = rig.scale();
    let (from, to) = (y0 - over, y1 + over);
    (0..shots)
        .map(|i| {
            let y = from + (to - from) * i as f64 / (shots.max(2) - 1) as f64;
            Rigid::new(rotation, Vec3::new((x0 + x1) / 2.0, y, scene.spec.focus_height_mm) - met)
        })
        .collect()
}

/// Five points of the scene's region, seen by the pointer from the working distance with a slight tilt.
pub fn surface_views(station: &Station, scene: &Scene) -> Vec<Rigid<InScene, Camera>> {
    let [x0, y0, x1, y1] = scene.spec.region_mm;
    let at = |fx: f64, fy: f64| (x0 + fx * (x1 - x0), y0 + fy * (y1 - y0));
    let beam = station.pointer.ray();
    [(0.06, 0.06), (0.94, 0.08), (0.92, 0.94), (0.07, 0.93), (0.5, 0.03)]
        .iter()
        .enumerate()
        .map(|(i, &(fx, fy))| {
            let (x, y) = at(fx, fy);
            let z = station.working_distance * (0.95 + 0.03 * i as f64);
            // Position of the beam at that depth, so that the spot and not the axis meets the point.
            let spot = beam.at((z - beam.origin.z) / beam.direction.z);
            above(x - spot.x, y + spot.y, z)
        })
        .collect()
}

/// The robot's pose for a camera pose.
pub fn flange(station: &Station, base_from_camera: &Rigid<Base, Camera>) -> Rigid<Base, Flange> {
    *base_from_camera * station.flange_from_camera.inverse()
}

/// The pose that the robot reports: the true pose with an independent error of `mm` and `deg`, 1 sigma per axis.
pub fn reported(pose: &Rigid<Base, Flange>, mm: f64, deg: f64, rng: &mut Pcg64) -> Rigid<Base, Flange> {
    let mut normal = |sigma: f64| {
        let n: f64 = StandardNormal.sample(rng);
        n * sigma
    };
    let w: [f64; 3] = std::array::from_fn(|_| normal(deg.to_radians()));
    let t: [f64; 3] = std::array::from_fn(|_| normal(mm));
    Rigid::new(exp(&Vec3::from(w)) * pose.rotation, pose.translation + Vec3::from(t))
}

/// Requirements for the poses of a board before the camera.
#[derive(Clone, Copy, Debug)]
pub struct Views {
    /// Number of poses.
    pub count: usize,
    /// Smallest distance of the board's middle, mm.
    pub near: f64,
    /// Largest distance of the board's middle, mm.
    pub far: f64,
    /// Largest tilt out of the image plane, degrees.
    pub tilt_deg: f64,
    /// Largest rotation in the image plane, degrees.
    pub turn_deg: f64,
    /// Share of the features that must be in the picture: 1 unless markers identify the corners.
    pub seen: f64,
}

/// Whether a beam falls on a board where it can be measured: inside the picture, with the sheet's middle well inside
/// the plate. The pointer must meet an evenly printed patch, because a print edge under the spot moves its centroid.
fn useful(station: &Station, board: &Pattern, pose: &Rigid<Camera, Board>, beam: Beam) -> bool {
    let plane = pose.plane(&Plane::<Board>::new(Vec3::z(), 0.0).expect("unit normal"));
    let ray = match beam {
        Beam::Line => Ray::new(station.laser.source, station.laser.axis),
        Beam::Pointer => Some(station.pointer.ray()),
    };
    let Some(p) = ray.and_then(|r| r.meet(&plane)) else { return false };
    let (w, h) = (f64::from(station.camera.width), f64::from(station.camera.height));
    let seen = station.camera.pixel_from_point(&p);
    if !seen.is_some_and(|q| q.x > 0.0 && q.y > 0.0 && q.x < w && q.y < h) {
        return false;
    }
    let p = pose.inverse().point(&p);
    let [x0, y0, x1, y1] = board.board.outline();
    let spot = station.pointer.waist_radius;
    let margin = if beam == Beam::Line { 0.2 * (y1 - y0) } else { 4.0 * spot };
    let inside = p.x > x0 + margin && p.x < x1 - margin && p.y > y0 + margin && p.y < y1 - margin;
    let around = |i: u32| Vec2::new(p.x, p.y) + 3.2 * spot * Vec2::new(f64::from(i).cos(), f64::from(i).sin());
    inside && (beam == Beam::Line || (0..12).map(around).all(|q| !board.is_black(q.x, q.y)))
}

/// Board poses that cover the image and the range of tilts; rejection sampling, seeded.
///
/// # Errors
/// A board that does not fit into the picture within the range of distances and tilts.
pub fn board_views(
    station: &Station,
    board: &BoardSpec,
    views: &Views,
    beam: Option<Beam>,
    purpose: &str,
) -> Result<Vec<Rigid<Camera, Board>>> {
    let pattern = Pattern::new(board)?;
    let features = board.features();
    let centre = features.iter().sum::<Vec3>() / features.len() as f64;
    let camera = &station.camera;
    let (w, h) = (f64::from(camera.width), f64::from(camera.height));
    let edge = 0.02 * w;
    // The board's long side lies along the picture's.
    let upright = if h > w { 90f64.to_radians() } else { 0.0 };
    let inside = |p: Vec3| {
        camera.pixel_from_point(&p).is_some_and(|q| q.x > edge && q.y > edge && q.x < w - edge && q.y < h - edge)
    };
    let view = |i: usize| {
        let mut rng = station.rng(purpose, i as u64);
        // The poses spread less about the picture's middle as the attempts go on, so that a board that barely fits
        // is still placed.
        (0..20_000).find_map(|attempt| {
            let spread = 1.0 - f64::from(attempt) / 20_000.0;
            let mut within = |by: f64| rng.random_range(-by..=by);
            let px = Vec2::new(w / 2.0 + within(0.45 * w) * spread, h / 2.0 + within(0.45 * h) * spread);
            let azimuth = within(std::f64::consts::PI);
            let tilt = within(views.tilt_deg).to_radians();
            let turn = upright + within(views.turn_deg).to_radians();
            let z = rng.random_range(views.near..=views.far);
            let ray = camera.ray_from_pixel(&px)?;
            let rotation = exp(&(Vec3::new(azimuth.cos(), azimuth.sin(), 0.0) * tilt)) * exp(&(Vec3::z() * turn));
            let pose: Rigid<Camera, Board> =
                Rigid::new(rotation, ray.direction * (z / ray.direction.z) - rotation * centre);
            let lit = beam.is_none_or(|b| useful(station, &pattern, &pose, b));
            let seen = || features.iter().filter(|p| inside(pose.point(p))).count();
            (lit && seen() as f64 >= views.seen * features.len() as f64).then_some(pose)
        })
    };
    let found: Option<Vec<_>> = (0..views.count).map(view).collect();
    found.ok_or_else(|| {
        Fault::usage(format!(
            "{:.0} % of the board's {} features do not come into the picture at {:.0} to {:.0} mm",
            100.0 * views.seen,
            features.len(),
            views.near,
            views.far
        ))
        .cause("the board is too large for this camera and distance")
        .next("simulate a smaller board, or a ChArUco board, which may be partly seen")
    })
}
