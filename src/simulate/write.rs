//! In: what to simulate (sets, scene, seed, noise). Out: recording folders, each with `truth.json`, and
//! a station folder with the true calibration.
//! Frame and unit: the recording format of docs/file-formats.md, mm.

use super::light::{Canvas, InScene, View};
use super::options::{DEFAULT_SCENE, Set, SimulateOptions};
use super::picture::{expose, hot_pixels};
use super::plan::{self, Views};
use super::ride::Ride;
use super::rig::{RigSpec, three_digits};
use super::scene::{Scene, SceneSpec};
use super::station::{Station, TRUE_VALUES};
use super::truth::TruthFile;
use crate::fault::{Fault, Result};
use crate::geometry::{AxisKind, Base, Board, Camera, Flange, Mat3, Rigid, Vec3};
use crate::raster::{Image, save_png};
use crate::recording::{AmbientRef, Beam, BoardSpec, FrameRef, ImageSpec, Meta, Motion, save_poses};
use crate::rig::{Calibration, Covariance, Kind, Quality, Rig, Verdict};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// What was written.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Simulated {
    /// Folder of the station with its true calibration.
    pub station: PathBuf,
    /// Name of the set, its folder, its pictures.
    pub recordings: Vec<(String, PathBuf, usize)>,
}

/// Writes the recordings and the station under `out`; `progress(done, of)` counts pictures.
pub fn simulate(out: &Path, options: &SimulateOptions, progress: &(dyn Fn(usize, usize) + Sync)) -> Result<Simulated> {
    options.check()?;
    let station = options.station();
    let spec = match (&options.scene, &options.rig) {
        (Some(path), _) => SceneSpec::load(path)?,
        (None, None) => SceneSpec::parse(DEFAULT_SCENE)?,
        (None, Some(rig)) => rig.scene(),
    };
    let scene = Scene::new(spec)?;
    let folder = out.join("station");
    crate::files::make_folder(&folder)?;
    station.store(&folder)?;
    let ride = options.motion.map(|kind| {
        let board = options.board.clone().unwrap_or_else(|| riding_board(&station.rig));
        (Ride::new(kind, &station, &scene, &board, options.shots), board)
    });
    if let Some((ride, _)) = &ride {
        store_axis(ride, &folder)?;
    }
    if let (None, Some(rig)) = (&options.scene, &options.rig) {
        crate::files::write(&out.join("notched.toml"), rig.recipe(options.shots).as_bytes())?;
    }
    let plans: Vec<Plan> = options
        .sets
        .iter()
        .map(|set| Plan::new(*set, &station, &scene, options, ride.as_ref()))
        .collect::<Result<_>>()?;
    let total = plans.iter().map(|p| p.shots.iter().map(Shot::pictures).sum::<usize>()).sum();
    let done = std::sync::atomic::AtomicUsize::new(0);
    let count = || progress(1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed), total);
    let mut recordings = Vec::new();
    for plan in &plans {
        let folder = out.join(plan.set.name());
        let pictures = plan.write(&folder, &station, options, &count)?;
        recordings.push((plan.set.name().to_owned(), folder, pictures));
    }
    Ok(Simulated { station: folder, recordings })
}

/// What stands before the camera in one moment, and which pictures are taken.
struct Shot {
    scene_from_camera: Rigid<InScene, Camera>,
    /// Index into the plan's scenes.
    scene: usize,
    laser: Option<Beam>,
    ambient: bool,
    board: Option<usize>,
}

impl Shot {
    fn pictures(&self) -> usize {
        usize::from(self.laser.is_some()) + usize::from(self.ambient)
    }
}

struct Plan {
    set: Set,
    scenes: Vec<Scene>,
    boards: Vec<BoardSpec>,
    shots: Vec<Shot>,
    /// True robot poses, one a shot; none for sets without a robot.
    poses: Vec<Rigid<Base, Flange>>,
    /// Where an axis stood, one a shot; none where no axis moves.
    counts: Vec<f64>,
    truth: TruthFile,
    motion: Option<Motion>,
}

/// The board that rides on an axis when no other is named: small enough to be in the picture along some way of it, or all around.
pub fn riding_board(rig: &RigSpec) -> BoardSpec {
    chessboard(9, 6, 6.0, 5.0, rig.board_scale())
}

/// The true axis as a calibration of the station.
fn store_axis(ride: &Ride, station: &Path) -> Result<()> {
    let kind = match ride.axis.kind {
        AxisKind::Linear => Kind::LinearAxis,
        AxisKind::Turntable => Kind::Turntable,
    };
    let quality = Quality {
        verdict: Verdict::Good,
        reasons: vec![TRUE_VALUES.into()],
        advice: vec![],
        figures: Default::default(),
        per_picture: vec![],
    };
    let names = kind.parameters().0;
    let covariance = Covariance::new(names, &nalgebra::DMatrix::zeros(names.len(), names.len()));
    let camera = Rig::load_camera(station)?.camera;
    Rig::store(station, &Calibration::new(kind, ride.axis, camera.as_ref(), covariance, quality), None).map(|_| ())
}

/// A board of our choice, `scale` times as large, to three digits.
fn chessboard(columns: u32, rows: u32, square_mm: f64, border_mm: f64, scale: f64) -> BoardSpec {
    let [square_mm, border_mm] = [square_mm, border_mm].map(|mm| three_digits(mm * scale));
    BoardSpec::Chessboard { inner_corners: [columns, rows], square_mm, border_mm, first_square: "black".into() }
}

/// A board's scene has its z out of the board, the board's own z goes into it.
pub fn scene_from_board() -> Rigid<InScene, Board> {
    Rigid::new(Mat3::from_diagonal(&Vec3::new(1.0, -1.0, -1.0)), Vec3::zeros())
}

impl Plan {
    fn new(
        set: Set,
        station: &Station,
        scene: &Scene,
        options: &SimulateOptions,
        ride: Option<&(Ride, BoardSpec)>,
    ) -> Result<Plan> {
        let truth = TruthFile::of(station, set.name());
        let (scenes, boards, shots, poses, counts) = (vec![], vec![], vec![], vec![], vec![]);
        let mut plan = Plan { set, scenes, boards, shots, poses, counts, truth, motion: None };
        if let (Some((ride, board)), Set::Scan | Set::Axis) = (ride, set) {
            plan.ride(station, scene, ride, board)?;
            return Ok(plan);
        }
        // Poses of boards whose middle is so many working distances away, and how large boards are beside those that the
        // default rig sees there: they come into the picture whole, and nobody holds one outside the working volume.
        let (rig, z) = (&station.rig, station.working_distance);
        let views = |count, wanted: [f64; 2], tilt_deg, turn_deg| {
            let [near, far] = rig.board_distances(wanted, z);
            (Views { count, near, far, tilt_deg, turn_deg, seen: 1.0 }, rig.board_scale() * near / (wanted[0] * z))
        };
        match set {
            Set::Axis => unreachable!("refused without an axis"),
            Set::Scan | Set::Surface => {
                let base_from_scene = plan::base_from_scene(station);
                plan.truth = plan.truth.with_scene(scene, base_from_scene);
                plan.scenes = vec![scene.clone()];
                let cameras = match (set, &options.poses) {
                    (Set::Scan, None) => plan::scan(station, scene, options.shots),
                    (_, Some(poses)) => {
                        let scene_from_base = base_from_scene.inverse();
                        poses.iter().map(|p| scene_from_base * *p * station.flange_from_camera).collect()
                    }
                    _ => plan::surface_views(station, scene),
                };
                for (i, camera) in cameras.iter().enumerate() {
                    let laser = Some(if set == Set::Scan { Beam::Line } else { Beam::Pointer });
                    let ambient = set == Set::Scan && i == cameras.len() / 2;
                    plan.shots.push(Shot { scene_from_camera: *camera, scene: 0, laser, ambient, board: None });
                    plan.poses.push(plan::flange(station, &(base_from_scene * *camera)));
                }
            }
            Set::Intrinsics => {
                let (views, k) = views(20, [1.1, 2.0], 40.0, 25.0);
                plan.show_boards(station, vec![chessboard(9, 6, 15.0, 9.0, k)], &views, None, options)?;
            }
            Set::Handeye => {
                let (views, k) = views(16, [1.2, 2.0], 35.0, 80.0);
                plan.show_boards(station, vec![chessboard(9, 6, 15.0, 9.0, k)], &views, None, options)?;
                let base_from_board: Rigid<Base, Board> =
                    Rigid::from_vectors(&Vec3::new(3.1, 0.02, 0.03), Vec3::new(470.0, -80.0, 60.0));
                plan.truth.base_from_board = Some(base_from_board);
                let robot = |v: &Rigid<Camera, Board>| plan::flange(station, &(base_from_board * v.inverse()));
                plan.poses = plan.truth.camera_from_board.iter().map(robot).collect();
            }
            Set::Laserplane => {
                let (views, k) = views(14, [0.75, 1.35], 30.0, 15.0);
                let boards = vec![chessboard(9, 6, 8.0, 6.0, k), chessboard(8, 5, 10.0, 6.0, k)];
                plan.show_boards(station, boards, &views, Some(Beam::Line), options)?;
            }
            Set::PointerCal => {
                let (views, k) = views(12, [0.7, 1.85], 20.0, 10.0);
                plan.show_boards(station, vec![chessboard(9, 6, 8.0, 6.0, k)], &views, Some(Beam::Pointer), options)?;
            }
            Set::Pointer => {
                let [near, far] = station.pointer_range;
                let half = 1.4 * far;
                let plate = SceneSpec::parse(&format!(
                    "name = 'plate'\nregion_mm = [{a}, {a}, {half}, {half}]\n[[solid]]\nshape = {{ block = {{ size_mm = [{s}, {s}, 5] }} }}\nat_mm = [0, 0, 0]",
                    a = -half,
                    s = 3.1 * far,
                ));
                plan.scenes = vec![Scene::new(plate.expect("well formed")).expect("one solid")];
                plan.truth.distances_mm = (0..23).map(|i| near + (far - near) / 22.0 * f64::from(i)).collect();
                let shot = |distance: &f64| Shot {
                    scene_from_camera: plan::above(0.0, 0.0, *distance),
                    scene: 0,
                    laser: Some(Beam::Pointer),
                    ambient: false,
                    board: None,
                };
                plan.shots = plan.truth.distances_mm.iter().map(shot).collect();
            }
        }
        Ok(plan)
    }

    /// What comes past a sensor that stands still: the scene, shot by shot, or a board, stop by stop.
    fn ride(&mut self, station: &Station, scene: &Scene, ride: &Ride, board: &BoardSpec) -> Result<()> {
        self.motion = Some(ride.motion());
        self.truth.axis = Some(ride.axis);
        if self.set == Set::Axis {
            self.scenes = vec![Scene::of_board(board, 0.85, 0.06)?];
            self.boards = vec![board.clone()];
            for (count, pose) in ride.stops(station, board)? {
                let scene_from_camera = scene_from_board() * pose.inverse();
                self.shots.push(Shot { scene_from_camera, scene: 0, laser: None, ambient: true, board: None });
                self.counts.push(count);
                self.truth.camera_from_board.push(pose);
            }
            return Ok(());
        }
        self.truth = self.truth.clone().with_scene(scene, ride.cloud_from_scene());
        self.scenes = vec![scene.clone()];
        for (i, count) in ride.counts.iter().enumerate() {
            let (scene_from_camera, ambient) = (ride.scene_from_camera(*count), i == ride.counts.len() / 2);
            self.shots.push(Shot { scene_from_camera, scene: 0, laser: Some(Beam::Line), ambient, board: None });
            self.counts.push(*count);
        }
        Ok(())
    }

    /// Boards in free poses, one after another; with a beam each pose is seen by room light and by laser.
    fn show_boards(
        &mut self,
        station: &Station,
        ours: Vec<BoardSpec>,
        views: &Views,
        laser: Option<Beam>,
        options: &SimulateOptions,
    ) -> Result<()> {
        let boards = options.board.clone().map_or_else(|| ours.clone(), |b| vec![b]);
        self.scenes = boards.iter().map(|b| Scene::of_board(b, 0.85, 0.06)).collect::<Result<_>>()?;
        // A board of another size is shown as large as ours, unless a beam has to meet it at its own distance.
        let size = |b: &BoardSpec| {
            let [x0, y0, x1, y1] = b.outline();
            (x1 - x0).hypot(y1 - y0)
        };
        let scale = if laser.is_none() { size(&boards[0]) / size(&ours[0]) } else { 1.0 };
        let seen = if matches!(boards[0], BoardSpec::Charuco { .. }) { 0.6 } else { views.seen };
        let (near, far) = (views.near * scale, views.far * scale);
        let each = Views { count: views.count / boards.len(), near, far, seen, ..*views };
        for (i, board) in boards.iter().enumerate() {
            for pose in plan::board_views(station, board, &each, laser, &format!("{} {i}", self.set.name()))? {
                let scene_from_camera = scene_from_board() * pose.inverse();
                let board = laser.map(|_| i);
                self.shots.push(Shot { scene_from_camera, scene: i, laser, ambient: true, board });
                self.truth.camera_from_board.push(pose);
            }
        }
        self.boards = boards;
        Ok(())
    }

    fn meta(&self, station: &Station) -> Meta {
        let single = self.boards.len() == 1 && matches!(self.set, Set::Intrinsics | Set::Handeye | Set::Axis);
        let beam = self.shots.first().and_then(|s| s.laser);
        let mut meta = Meta {
            format: 1,
            set: self.set.name().into(),
            units: "mm".into(),
            image: ImageSpec {
                width: station.camera.width,
                height: station.camera.height,
                bits: station.sensor.bits,
                channels: 1,
                response: crate::raster::Response::Linear,
                pixel_centre: "integer coordinates".into(),
            },
            beam,
            board: single.then(|| self.boards[0].clone()),
            boards: if single { vec![] } else { self.boards.clone() },
            ambient: None,
            frames: vec![],
            frames_file: None,
            sources: None,
            motion: self.motion.clone(),
            pose_file: None,
            pose_files: Default::default(),
            part: None,
            model: None,
            target: None,
            distance_definition: None,
        };
        for (i, shot) in self.shots.iter().enumerate() {
            // A scan has one picture in room light for the whole recording, not one a frame.
            let lone = self.set == Set::Scan;
            let pose = (!self.poses.is_empty()).then_some(i);
            if shot.ambient && lone {
                meta.ambient = Some(AmbientRef { file: "ambient.png".into(), pose });
            }
            meta.frames.push(FrameRef {
                laser: shot.laser.map(|_| format!("laser_{i:04}.png")),
                ambient: (shot.ambient && !lone).then(|| format!("ambient_{i:04}.png")),
                pose,
                board: shot.board,
                count: self.counts.get(i).copied(),
                ..FrameRef::default()
            });
        }
        match self.set {
            Set::Handeye => {
                meta.pose_files.insert("poses_exact".into(), "encoder readings without error".into());
                meta.pose_files.insert("poses_noisy".into(), "readings with the errors of a real arm".into());
            }
            Set::Pointer => {
                meta.target = Some("matte flat plate perpendicular to the optical axis".into());
                meta.distance_definition =
                    Some("camera_z: distance from the camera centre to the plate along the optical axis".into());
            }
            Set::Scan => meta.target = Some(self.scenes[0].spec.name.clone()),
            _ => {}
        }
        if !self.poses.is_empty() && self.set != Set::Handeye {
            meta.pose_file = Some("poses".into());
        }
        meta
    }

    fn write(
        &self,
        folder: &Path,
        station: &Station,
        options: &SimulateOptions,
        count: &(dyn Fn() + Sync),
    ) -> Result<usize> {
        crate::files::make_folder(folder)?;
        // A folder with a meta.json is complete: that of a former simulation goes first, the new one comes last.
        let meta = folder.join("meta.json");
        crate::files::remove(&meta).map_err(|e| Fault::write(&meta, e))?;
        let pixels = station.camera.width as usize * station.camera.height as usize;
        let hot = hot_pixels(&station.sensor, pixels, &mut station.rng("hot", 0));
        let visible: Vec<Vec<Vec3>> = self
            .shots
            .par_iter()
            .enumerate()
            .map(|(i, shot)| self.take(i, shot, folder, station, &hot, count))
            .collect::<Result<_>>()?;
        let mut truth = self.truth.clone();
        let (mm, deg) = match self.set {
            // The noisy poses of a hand-eye recording are those of a real arm.
            Set::Handeye if options.pose_noise_mm == 0.0 && options.pose_noise_deg == 0.0 => (0.05, 0.02),
            _ => (options.pose_noise_mm, options.pose_noise_deg),
        };
        (truth.pose_noise_mm, truth.pose_noise_deg) = (mm, deg);
        if !self.poses.is_empty() {
            let mut rng = station.rng("pose noise", self.set as u64);
            let noisy: Vec<_> = self.poses.iter().map(|p| plan::reported(p, mm, deg, &mut rng)).collect();
            let (exact, shown) = match self.set {
                Set::Handeye => ("poses_exact.json", "poses_noisy.json"),
                _ => ("poses_true.json", "poses.json"),
            };
            save_poses(&folder.join(exact), &self.poses)?;
            save_poses(&folder.join(shown), &noisy)?;
        }
        if let (Set::Scan, Some(base_from_scene)) = (self.set, truth.base_from_scene) {
            let points: Vec<Vec3> = visible.iter().flatten().map(|p| base_from_scene.point(p)).collect();
            crate::files::write(&folder.join("visible.ply"), &points_ply(&points))?;
        }
        let json = |value: serde_json::Result<String>| value.expect("plain data").into_bytes();
        crate::files::write(&folder.join("truth.json"), &json(serde_json::to_string_pretty(&truth)))?;
        crate::files::write(&meta, &json(serde_json::to_string_pretty(&self.meta(station))))?;
        Ok(self.shots.iter().map(Shot::pictures).sum())
    }

    /// Takes one shot's pictures; returns the stripe's points that are bright enough to be measured.
    fn take(
        &self,
        i: usize,
        shot: &Shot,
        folder: &Path,
        station: &Station,
        hot: &[(usize, f32)],
        count: &(dyn Fn() + Sync),
    ) -> Result<Vec<Vec3>> {
        let view = View { station, scene: &self.scenes[shot.scene], scene_from_camera: shot.scene_from_camera };
        let (w, h) = (station.camera.width, station.camera.height);
        let sensor = &station.sensor;
        let save = |name: String, picture: Image| save_png(&picture, &folder.join(name)).map(|()| count());
        if shot.ambient {
            // 3 x 3 rays a pixel at 640; a finer sensor's own pixels sample the edges.
            let room = view.ambient(if w > 1600 { 1 } else { 3 });
            let mut rng = station.rng(self.set.name(), 2 * i as u64);
            let gain = sensor.ambient_white as f32;
            let picture = expose(sensor, &Canvas::new(w, h), &room, gain, hot, &mut rng);
            save(if self.set == Set::Scan { "ambient.png".into() } else { format!("ambient_{i:04}.png") }, picture)?;
        }
        let Some(beam) = shot.laser else { return Ok(vec![]) };
        let mut light = Canvas::new(w, h);
        let middle = match beam {
            Beam::Line => view.sheet(&mut light),
            Beam::Pointer => view.spot(&mut light).into_iter().collect(),
        };
        let room = if sensor.ambient_leak > 0.0 { view.faint_ambient() } else { Canvas::new(w, h) };
        let mut rng = station.rng(self.set.name(), 2 * i as u64 + 1);
        let picture = expose(sensor, &light, &room, sensor.ambient_leak as f32, hot, &mut rng);
        save(format!("laser_{i:04}.png"), picture)?;
        let bright = |u: f64, v: f64| {
            let (x, y) = (u.round(), v.round());
            let inside = x >= 0.0 && y >= 0.0 && x < f64::from(w) && y < f64::from(h);
            // 6 % of full scale: about 15 of 255 grey levels.
            inside && light.pixels[y as usize * w as usize + x as usize] > 0.06
        };
        Ok(middle.iter().filter(|p| bright(p.u, p.v)).map(|p| p.point).collect())
    }
}

/// A point list as binary PLY (x y z, float32).
fn points_ply(points: &[Vec3]) -> Vec<u8> {
    let mut out = format!(
        "ply\nformat binary_little_endian 1.0\ncomment units mm, base frame\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
        points.len()
    )
    .into_bytes();
    for p in points {
        p.iter().for_each(|x| out.extend((*x as f32).to_le_bytes()));
    }
    out
}
