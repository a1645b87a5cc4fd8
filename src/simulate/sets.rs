//! In: a set of recordings, a station, a scene. Out: for each shot what is before the camera, the position of robot
//! or axis, and the true values.
//! Frame and unit: scene, base, camera, board; mm.

use super::light::InScene;
use super::options::{Set, SimulateOptions};
use super::plan::{self, Views};
use super::ride::Ride;
use super::rig::{RigSpec, three_digits};
use super::scene::{Scene, SceneSpec};
use super::station::Station;
use super::truth::TruthFile;
use crate::fault::Result;
use crate::geometry::{Base, Board, Camera, Flange, Mat3, Rigid, Vec3};
use crate::recording::{Beam, BoardSpec, Motion};

/// What is before the camera in one moment, and which pictures are taken.
pub(super) struct Shot {
    pub scene_from_camera: Rigid<InScene, Camera>,
    /// Index into the plan's scenes.
    pub scene: usize,
    pub laser: Option<Beam>,
    pub ambient: bool,
    pub board: Option<usize>,
}

/// The shots of one set.
pub(super) struct Plan {
    pub set: Set,
    pub scenes: Vec<Scene>,
    pub boards: Vec<BoardSpec>,
    pub shots: Vec<Shot>,
    /// True robot poses, one a shot; empty for sets without a robot.
    pub poses: Vec<Rigid<Base, Flange>>,
    /// Counts of the axis, one a shot; empty if no axis moves.
    pub counts: Vec<f64>,
    pub truth: TruthFile,
    pub motion: Option<Motion>,
    /// Exposure times of the laser pictures of each shot, us; empty: one picture a shot.
    pub exposures_us: Vec<f64>,
}

/// The board that rides on an axis if no other is named. It is small enough to be in the picture along some of the
/// travel, or during a whole turn.
pub fn riding_board(rig: &RigSpec) -> BoardSpec {
    chessboard(9, 6, 6.0, 5.0, rig.board_scale())
}

/// A built-in board, scaled by `scale`, with sizes to three digits.
fn chessboard(columns: u32, rows: u32, square_mm: f64, border_mm: f64, scale: f64) -> BoardSpec {
    let [square_mm, border_mm] = [square_mm, border_mm].map(|mm| three_digits(mm * scale));
    BoardSpec::Chessboard { inner_corners: [columns, rows], square_mm, border_mm, first_square: "black".into() }
}

/// In a board's scene z points out of the board; the board's own z points into it.
pub fn scene_from_board() -> Rigid<InScene, Board> {
    Rigid::new(Mat3::from_diagonal(&Vec3::new(1.0, -1.0, -1.0)), Vec3::zeros())
}

impl Plan {
    /// Number of pictures of all shots.
    pub fn pictures(&self) -> usize {
        let exposures = self.exposures_us.len().max(1);
        self.shots.iter().map(|s| exposures * usize::from(s.laser.is_some()) + usize::from(s.ambient)).sum()
    }

    /// `ride` moves the scanned part in [`Set::Scan`] and [`Set::Axis`]; [`Set::Axis`] requires it.
    pub fn new(
        set: Set,
        station: &Station,
        scene: &Scene,
        options: &SimulateOptions,
        ride: Option<&(Ride, BoardSpec)>,
    ) -> Result<Plan> {
        let truth = TruthFile::of(station, set.name());
        let (scenes, boards, shots, poses, counts) = (vec![], vec![], vec![], vec![], vec![]);
        let mut plan =
            Plan { set, scenes, boards, shots, poses, counts, truth, motion: None, exposures_us: Vec::new() };
        if set == Set::Scan {
            plan.exposures_us = options.exposures_us();
        }
        match (set, ride) {
            (Set::Scan | Set::Axis, Some((ride, board))) => plan.ride(station, scene, ride, board)?,
            (Set::Axis, None) => unreachable!("refused without an axis"),
            (Set::Scan | Set::Surface, _) => plan.show_scene(station, scene, options),
            (Set::Pointer, _) => plan.show_plate(station),
            _ => plan.show_boards(station, options)?,
        }
        Ok(plan)
    }

    /// Shows the scene to the robot's sensor, lit by the line or by the pointer.
    fn show_scene(&mut self, station: &Station, scene: &Scene, options: &SimulateOptions) {
        let base_from_scene = plan::base_from_scene(station);
        self.truth = self.truth.clone().with_scene(scene, base_from_scene);
        self.scenes = vec![scene.clone()];
        let cameras = match (self.set, &options.poses) {
            (Set::Scan, None) => plan::scan(station, scene, options.shots),
            (_, Some(poses)) => {
                let scene_from_base = base_from_scene.inverse();
                poses.iter().map(|p| scene_from_base * *p * station.flange_from_camera).collect()
            }
            _ => plan::surface_views(station, scene),
        };
        for (i, camera) in cameras.iter().enumerate() {
            let laser = Some(if self.set == Set::Scan { Beam::Line } else { Beam::Pointer });
            let ambient = self.set == Set::Scan && i == cameras.len() / 2;
            self.shots.push(Shot { scene_from_camera: *camera, scene: 0, laser, ambient, board: None });
            self.poses.push(plan::flange(station, &(base_from_scene * *camera)));
        }
    }

    /// Shows a plate that the pointer meets at equal steps of distance.
    fn show_plate(&mut self, station: &Station) {
        let [near, far] = station.pointer_range;
        let half = 1.4 * far;
        let plate = SceneSpec::parse(&format!(
            "name = 'plate'\nregion_mm = [{a}, {a}, {half}, {half}]\n[[solid]]\nshape = {{ block = {{ size_mm = \
             [{s}, {s}, 5] }} }}\nat_mm = [0, 0, 0]",
            a = -half,
            s = 3.1 * far,
        ));
        self.scenes = vec![Scene::new(plate.expect("well formed")).expect("one solid")];
        self.truth.distances_mm = (0..23).map(|i| near + (far - near) / 22.0 * f64::from(i)).collect();
        let shot = |distance: &f64| Shot {
            scene_from_camera: plan::above(0.0, 0.0, *distance),
            scene: 0,
            laser: Some(Beam::Pointer),
            ambient: false,
            board: None,
        };
        self.shots = self.truth.distances_mm.iter().map(shot).collect();
    }

    /// Shows the boards of a set from which camera, hand-eye, laser plane or pointer is calibrated.
    fn show_boards(&mut self, station: &Station, options: &SimulateOptions) -> Result<()> {
        // `wanted` is the range of board distances in working distances. The size factor is relative to the boards
        // that the default rig sees at that distance. Boards fit into the picture completely and stay inside the
        // working volume.
        let (rig, z) = (&station.rig, station.working_distance);
        let views = |count, wanted: [f64; 2], tilt_deg, turn_deg| {
            let [near, far] = rig.board_distances(wanted, z);
            (Views { count, near, far, tilt_deg, turn_deg, seen: 1.0 }, rig.board_scale() * near / (wanted[0] * z))
        };
        let large = |k: f64| chessboard(9, 6, 15.0, 9.0, k);
        let small = |k: f64| chessboard(9, 6, 8.0, 6.0, k);
        let (views, ours, beam) = match self.set {
            Set::Intrinsics => {
                let (views, k) = views(20, [1.1, 2.0], 40.0, 25.0);
                (views, vec![large(k)], None)
            }
            Set::Handeye => {
                let (views, k) = views(16, [1.2, 2.0], 35.0, 80.0);
                (views, vec![large(k)], None)
            }
            Set::Laserplane => {
                let (views, k) = views(14, [0.75, 1.35], 30.0, 15.0);
                (views, vec![small(k), chessboard(8, 5, 10.0, 6.0, k)], Some(Beam::Line))
            }
            Set::PointerCal => {
                let (views, k) = views(12, [0.7, 1.85], 20.0, 10.0);
                (views, vec![small(k)], Some(Beam::Pointer))
            }
            Set::Scan | Set::Surface | Set::Axis | Set::Pointer => unreachable!("shows no boards in free poses"),
        };
        self.pose_boards(station, ours, &views, beam, options)?;
        // The board stands still before the robot, which carries the camera.
        if self.set == Set::Handeye {
            let base_from_board: Rigid<Base, Board> =
                Rigid::from_vectors(&Vec3::new(3.1, 0.02, 0.03), Vec3::new(470.0, -80.0, 60.0));
            self.truth.base_from_board = Some(base_from_board);
            let robot = |v: &Rigid<Camera, Board>| plan::flange(station, &(base_from_board * v.inverse()));
            self.poses = self.truth.camera_from_board.iter().map(robot).collect();
        }
        Ok(())
    }

    /// Shows what passes a fixed sensor: the scene, shot by shot, or a board, stop by stop.
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

    /// Shows boards in free poses, one after another; with a beam each pose is seen by room light and by laser.
    fn pose_boards(
        &mut self,
        station: &Station,
        ours: Vec<BoardSpec>,
        views: &Views,
        laser: Option<Beam>,
        options: &SimulateOptions,
    ) -> Result<()> {
        let boards = options.board.clone().map_or_else(|| ours.clone(), |b| vec![b]);
        self.scenes = boards.iter().map(|b| Scene::of_board(b, 0.85, 0.06)).collect::<Result<_>>()?;
        // A board of another size is moved until it appears as large as the built-in one, unless a beam has to meet
        // it at a fixed distance.
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
}
