//! In: a rig's design, a seed, levels of noise. Out: stops of a calibration as features, with the truth that made them.
//! Frame and unit: mm, rad, px. Nothing of the solver is used to make them.

use crate::common::judge::{gauss, gauss2};
use nalgebra::Matrix2;
use rand::SeedableRng;
use rand_pcg::Pcg64;
use sheetlight::calibrate::hand_eye::closed::{Far, Near};
use sheetlight::calibrate::joint::options::{JointOptions, Noise};
use sheetlight::calibrate::joint::shots::{Reported, Shot, Spot, thinned};
use sheetlight::calibrate::joint::solve::{JointFit, solve};
use sheetlight::calibrate::joint::start::start;
use sheetlight::calibrate::joint::unknowns::State;
use sheetlight::calibrate::joint::volume::{apart, expected, places, weights};
use sheetlight::calibrate::laser_plane::views::StripePeak;
use sheetlight::calibrate::measured_pose::SeenBoard;
use sheetlight::camera::Intrinsics;
use sheetlight::fault::Result;
use sheetlight::geometry::{Base, Board, Camera, Flange, Plane, Rigid, Vec2, Vec3};
use sheetlight::recording::BoardSpec;
use sheetlight::simulate::{RigSpec, Station, Views, board_views, reported};

/// 1 sigma each.
#[derive(Clone, Copy, Debug)]
pub struct Levels {
    pub robot_mm: f64,
    pub robot_deg: f64,
    pub corner_px: f64,
    /// Of a single peak across the stripe, neighbours independent.
    pub peak_px: f64,
    pub spot_px: f64,
}

pub const QUIET: Levels = Levels { robot_mm: 0.02, robot_deg: 0.004, corner_px: 0.04, peak_px: 0.1, spot_px: 0.1 };
pub const LOUD: Levels = Levels { robot_mm: 0.05, robot_deg: 0.02, ..QUIET };

/// A station with a board that stands still in the base.
pub struct Cell {
    pub station: Station,
    pub board: BoardSpec,
    pub base_from_board: Rigid<Base, Board>,
}

pub fn rig(name: &str) -> RigSpec {
    RigSpec::load(&std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("data/rigs/{name}.toml"))).unwrap()
}

impl Cell {
    pub fn new(rig: &RigSpec, seed: u64) -> Cell {
        let k = rig.board_scale();
        let board = BoardSpec::Chessboard {
            inner_corners: [9, 6],
            square_mm: 9.0 * k,
            border_mm: 6.0 * k,
            first_square: "black".into(),
        };
        let base_from_board = Rigid::from_vectors(&Vec3::new(3.1, 0.02, 0.03), Vec3::new(470.0, -80.0, 60.0));
        Cell { station: Station::of(rig, seed), board, base_from_board }
    }

    /// Depths in which it works.
    pub fn working(&self) -> [f64; 2] {
        [self.station.rig.working.near_mm, self.station.rig.working.far_mm]
    }

    /// Boards in view over the working volume, tilted by up to `tilt_deg`.
    pub fn views(&self, count: usize, tilt_deg: f64, purpose: &str) -> Vec<Rigid<Camera, Board>> {
        let [near, far] = self.station.rig.board_distances([0.85, 1.5], self.station.working_distance);
        let views = Views { count, near, far, tilt_deg, turn_deg: 180.0, seen: 1.0 };
        board_views(&self.station, &self.board, &views, None, purpose).unwrap()
    }

    pub fn robot(&self, board: &Rigid<Camera, Board>) -> Rigid<Base, Flange> {
        self.base_from_board * board.inverse() * self.station.flange_from_camera.inverse()
    }

    /// What is known of the station in truth, with a board's pose for each stop.
    pub fn truth(&self, views: &[Rigid<Camera, Board>]) -> State {
        let (x, w) = (&self.station.flange_from_camera, &self.base_from_board);
        State {
            camera: self.station.camera,
            near_from_camera: Rigid::<Near, Camera>::new(x.rotation, x.translation),
            far_from_board: vec![Rigid::<Far, Board>::new(w.rotation, w.translation)],
            plane: self.station.laser.plane(),
            beam: self.station.pointer.ray(),
            boards: views.to_vec(),
        }
    }

    /// What a stop's pictures show of a board at this pose.
    pub fn shot(&self, i: usize, board: &Rigid<Camera, Board>, n: &Levels, rng: &mut Pcg64) -> Shot {
        let points = self.board.features();
        let camera = &self.station.camera;
        let pixel = |p: &Vec3| camera.pixel_from_point(&board.point(p)).unwrap();
        let seen = SeenBoard {
            name: format!("stop {i}"),
            pixels: points.iter().map(|p| pixel(p) + gauss2(rng, n.corner_px)).collect(),
            sigmas_px: vec![0.02; points.len()],
            points,
        };
        let exact = self.robot(board);
        let pose = reported(&exact, n.robot_mm, n.robot_deg, rng);
        Shot {
            seen,
            robot: Some(Reported { pose, place: 0 }),
            stripe: thinned(&self.stripe(board, n, rng)),
            spot: self.spot(board, n, rng),
        }
    }

    fn on_plate(&self, board: &Rigid<Camera, Board>, p: &Vec3) -> bool {
        let q = board.inverse().point(p);
        let [x0, y0, x1, y1] = self.board.outline();
        q.x > x0 && q.x < x1 && q.y > y0 && q.y < y1
    }

    fn in_picture(&self, p: &Vec3) -> Option<Vec2> {
        let (w, h) = (f64::from(self.station.camera.width), f64::from(self.station.camera.height));
        self.station.camera.pixel_from_point(p).filter(|q| q.x > 0.0 && q.y > 0.0 && q.x < w - 1.0 && q.y < h - 1.0)
    }

    /// Peaks a pixel apart where the sheet meets the plate.
    fn stripe(&self, board: &Rigid<Camera, Board>, n: &Levels, rng: &mut Pcg64) -> Vec<StripePeak> {
        let sheet = self.station.laser.plane();
        let plate = board.plane(&Plane::<Board>::new(Vec3::z(), 0.0).unwrap());
        let along = sheet.normal.cross(&plate.normal).normalize();
        // The point of both planes nearest to the board's middle.
        let middle = board.point(&(self.board.features().iter().sum::<Vec3>() / self.board.features().len() as f64));
        let m = nalgebra::Matrix3::from_rows(&[sheet.normal.transpose(), plate.normal.transpose(), along.transpose()]);
        let Some(on) = m.lu().solve(&Vec3::new(sheet.offset, plate.offset, along.dot(&middle))) else { return vec![] };
        let step = on.z / self.station.camera.fx;
        (-2000..2000)
            .filter_map(|k| {
                let p = on + along * (f64::from(k) * step);
                if !self.on_plate(board, &p) {
                    return None;
                }
                let q = self.in_picture(&p)?;
                let further = self.station.camera.pixel_from_point(&(p + along * step))?;
                let across = Vec2::new(-(further - q).y, (further - q).x).normalize();
                let pixel = q + across * gauss(rng, n.peak_px);
                Some(StripePeak { pixel, sigma_px: 0.05, width_px: 1.5 })
            })
            .collect()
    }

    fn spot(&self, board: &Rigid<Camera, Board>, n: &Levels, rng: &mut Pcg64) -> Option<Spot> {
        let plate = board.plane(&Plane::<Board>::new(Vec3::z(), 0.0).unwrap());
        let p = self.station.pointer.ray().meet(&plate).filter(|p| self.on_plate(board, p))?;
        let pixel = self.in_picture(&p)? + gauss2(rng, n.spot_px);
        Some(Spot { pixel, covariance: Matrix2::identity() * 0.05 * 0.05 })
    }
}

/// A camera as its data sheet has it: no lens, the principal point in the middle.
pub fn data_sheet(cell: &Cell) -> Intrinsics {
    let c = &cell.station.camera;
    let f = cell.station.rig.focal_px();
    let (cx, cy) = (f64::from(c.width - 1) / 2.0, f64::from(c.height - 1) / 2.0);
    Intrinsics { fx: f, fy: f, cx, cy, skew: 0.0, distortion: Default::default(), ..*c }
}

pub fn calibrate(cell: &Cell, shots: &[Shot], o: &JointOptions) -> Result<JointFit> {
    let mut shots = shots.to_vec();
    let places = 1 + shots.iter().filter_map(|s| s.robot).map(|r| r.place).max().unwrap_or(0);
    let (state, _) = start(&mut shots, places, &data_sheet(cell), None, o)?;
    solve(&shots, &state, Noise::usual(), o)
}

/// True rms error of scanned points in the working volume, and what the solve expects.
pub fn errors(cell: &Cell, fit: &JointFit) -> [f64; 2] {
    let truth = cell.truth(&[]);
    let lit = places(&truth, cell.working());
    assert!(lit.len() > 20, "{} places", lit.len());
    [apart(&fit.state, &truth, &lit), expected(&weights(&fit.state, &fit.layout, &lit), &fit.covariance)]
}

/// Stops spread over the working volume, `tilt_deg` at most.
pub fn stops(cell: &Cell, count: usize, tilt_deg: f64, levels: &Levels, seed: u64) -> Vec<Shot> {
    let mut rng = Pcg64::seed_from_u64(seed.wrapping_mul(977) + 5);
    let views = cell.views(count, tilt_deg, &format!("joint {seed}"));
    views.iter().enumerate().map(|(i, v)| cell.shot(i, v, levels, &mut rng)).collect()
}
