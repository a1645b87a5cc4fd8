//! In: a seed. Out: stations from the whole space of rigs with a laser sheet (depth, view, stripe's direction,
//! laser's side and angle, boards) and their calibration pictures as board poses and stripe peaks, sound or with one
//! fault.
//! Frame and unit: camera frame, mm, px.

use super::judge::{between, gauss, gauss2};
use nalgebra::Matrix3;
use rand::Rng;
use rand_pcg::Pcg64;
use sheetlight::calibrate::laser_plane::views::StripePeak;
use sheetlight::calibrate::laser_plane::views::StripeView;
use sheetlight::calibrate::measured_pose::{SeenBoard, measure};
use sheetlight::camera::Intrinsics;
use sheetlight::geometry::{Board, Camera, Plane, Rigid, Vec2, Vec3, exp};
use sheetlight::recording::BoardSpec;

pub struct Sheet {
    pub camera: Intrinsics,
    pub plane: Plane<Camera>,
    pub boards: Vec<Rigid<Camera, Board>>,
    pub spec: BoardSpec,
    pub corner_px: f64,
    pub peak_px: f64,
    width_px: f64,
    /// What a pixel covers at the middle depth, mm.
    pub pixel_mm: f64,
}

/// Evenly in the logarithm.
pub fn log_between(rng: &mut Pcg64, low: f64, high: f64) -> f64 {
    between(rng, low.ln(), high.ln()).exp()
}

/// A sheet `angle` off the optical axis that lies towards `side` (rad in the picture) and meets the axis at `depth`.
fn sheet(side: f64, angle: f64, depth: f64) -> Plane<Camera> {
    let normal = Vec3::new(side.cos() * angle.cos(), side.sin() * angle.cos(), angle.sin());
    Plane::new(normal, normal.z * depth).unwrap()
}

impl Sheet {
    pub fn random(rng: &mut Pcg64, count: usize) -> Sheet {
        let depth = log_between(rng, 60.0, 1500.0);
        let [width, height] = [[640, 480], [1280, 1024], [480, 640], [2048, 1536]][rng.random_range(0..4)];
        let half_view: f64 = between(rng, 0.07, 0.5);
        let f = 0.5 * f64::from(width.max(height)) / half_view.tan();
        let bend = (half_view / 0.5).powi(2);
        let camera = Intrinsics {
            fx: f,
            fy: f * between(rng, 0.995, 1.005),
            cx: f64::from(width) * between(rng, 0.46, 0.54),
            cy: f64::from(height) * between(rng, 0.46, 0.54),
            skew: 0.0,
            distortion: [between(rng, -0.15, 0.05) * bend, between(rng, 0.0, 0.05) * bend, 0.0, 0.0, 0.0].into(),
            width,
            height,
        };
        // Lying, upright, diagonal from either side, or anything between.
        let eighth = rng.random_range(0..8);
        let side = f64::from(eighth) * std::f64::consts::FRAC_PI_4
            + if rng.random::<bool>() { between(rng, -0.4, 0.4) } else { 0.0 };
        let plane = sheet(side, between(rng, 0.2, 0.9), depth * between(rng, 0.95, 1.05));
        let view = camera.view_mm(depth);
        let square = view * between(rng, 0.35, 0.7) / 10.0;
        let spec = BoardSpec::Chessboard {
            inner_corners: [9, 6],
            square_mm: square,
            border_mm: 0.7 * square,
            first_square: "black".into(),
        };
        let range = log_between(rng, 0.04, 0.3);
        let middle = Vec3::new(4.0 * square, 2.5 * square, 0.0);
        let boards = (0..count)
            .map(|_| {
                let place = loop {
                    let z = depth * (1.0 + range * between(rng, -1.0, 1.0));
                    let across = (plane.offset - plane.normal.z * z) / plane.normal.xy().norm_squared();
                    let along = gauss(rng, 0.1 * view);
                    let n = plane.normal.xy();
                    let p = Vec3::new(n.x * across - n.y * along, n.y * across + n.x * along, z);
                    let q = camera.pixel_from_point(&p).unwrap();
                    let [x, y] = [q.x / f64::from(width), q.y / f64::from(height)];
                    if (0.2..0.8).contains(&x) && (0.2..0.8).contains(&y) {
                        break p;
                    }
                };
                let tilt = exp(&Vec3::new(between(rng, -0.5, 0.5), between(rng, -0.5, 0.5), 0.0));
                let turn = exp(&Vec3::new(0.0, 0.0, between(rng, -3.0, 3.0))) * tilt;
                Rigid::new(turn, place - turn * middle)
            })
            .collect();
        let square_px = f * square / depth;
        Sheet {
            camera,
            plane,
            boards,
            spec,
            corner_px: log_between(rng, 0.02, 0.15),
            peak_px: log_between(rng, 0.03, 0.2),
            width_px: between(rng, 0.6, (square_px / 10.0).clamp(0.7, 6.0)),
            pixel_mm: depth / f,
        }
    }

    /// True pixels of a plane's stripe on a board, at most `most`, within the picture.
    pub fn stripe(&self, plane: &Plane<Camera>, pose: &Rigid<Camera, Board>, most: u32) -> Vec<Vec2> {
        self.line(plane, pose, most).iter().filter_map(|p| self.in_picture(p)).collect()
    }

    fn in_picture(&self, p: &Vec3) -> Option<Vec2> {
        let q = self.camera.pixel_from_point(p)?;
        let [w, h] = [f64::from(self.camera.width), f64::from(self.camera.height)];
        ((0.0..w - 1.0).contains(&q.x) && (0.0..h - 1.0).contains(&q.y)).then_some(q)
    }

    /// Points of the line in which a plane cuts a board.
    pub fn line(&self, plane: &Plane<Camera>, pose: &Rigid<Camera, Board>, most: u32) -> Vec<Vec3> {
        let BoardSpec::Chessboard { square_mm, .. } = self.spec else { unreachable!() };
        let normal: Vec3 = pose.rotation.column(2).into();
        let along = plane.normal.cross(&normal).normalize();
        let m = Matrix3::from_rows(&[plane.normal.transpose(), normal.transpose(), along.transpose()]);
        let foot = m.try_inverse().unwrap() * Vec3::new(plane.offset, normal.dot(&pose.translation), 0.0);
        let centre = pose.point(&Vec3::new(4.0 * square_mm, 2.5 * square_mm, 0.0));
        let middle = foot + along * along.dot(&(centre - foot));
        let half = 6.0 * square_mm;
        (0..most).map(|k| middle + along * (half * (2.0 * f64::from(k) / f64::from(most - 1) - 1.0))).collect()
    }

    /// One board as `believed` sees it, without peaks. `rig` took the picture.
    pub fn board(&self, rng: &mut Pcg64, believed: &Intrinsics, rig: &Intrinsics, i: usize) -> StripeView {
        let points = self.spec.features();
        let noise = self.corner_px;
        let at =
            |p: &Vec3, rng: &mut Pcg64| rig.pixel_from_point(&self.boards[i].point(p)).unwrap() + gauss2(rng, noise);
        let pixels = points.iter().map(|p| at(p, rng)).collect();
        let sigmas_px = vec![noise; points.len()];
        let seen = SeenBoard { name: format!("picture {i}"), points, pixels, sigmas_px };
        StripeView {
            pose: measure(&seen, believed, &self.boards[i]).unwrap(),
            board: self.spec.clone(),
            peaks: Vec::new(),
        }
    }

    /// Peaks as found at these pixels.
    pub fn peaks(&self, rng: &mut Pcg64, pixels: Vec<Vec2>) -> Vec<StripePeak> {
        let (sigma_px, width_px) = (self.peak_px, self.width_px);
        pixels.into_iter().map(|p| StripePeak { pixel: p + gauss2(rng, sigma_px), sigma_px, width_px }).collect()
    }
}

/// What is wrong with a set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Flaw {
    None,
    /// Boards moved between their two pictures.
    Moved,
    /// A second line of light on the boards, in place of the stripe or beside it.
    Reflection,
    /// Some of the pictures are of another camera and laser.
    OtherRig,
    /// The laser was pushed during the recording.
    Pushed,
    /// Peaks in broken pieces that lie off the stripe, each picture's by its own.
    Broken,
}

pub const FLAWS: [Flaw; 6] = [Flaw::None, Flaw::Moved, Flaw::Reflection, Flaw::OtherRig, Flaw::Pushed, Flaw::Broken];

const PEAKS: u32 = 120;

/// The pictures of a calibration set with a flaw.
pub fn set(rng: &mut Pcg64, s: &Sheet, flaw: Flaw) -> Vec<StripeView> {
    let count = s.boards.len();
    let size_px = log_between(rng, 0.3, 40.0);
    let share = between(rng, 0.1, 0.5);
    let wrong: Vec<bool> = match flaw {
        Flaw::None => vec![false; count],
        Flaw::Broken => vec![true; count],
        // The last pictures of the recording.
        Flaw::Pushed | Flaw::OtherRig => (0..count).map(|i| i >= ((1.0 - share) * count as f64) as usize).collect(),
        Flaw::Moved => (0..count).map(|_| rng.random::<f64>() < 0.6 * share).collect(),
        Flaw::Reflection => (0..count).map(|_| rng.random::<f64>() < 2.0 * share).collect(),
    };
    let mm = size_px * s.pixel_mm;
    let tilt = Vec3::new(gauss(rng, 0.01), gauss(rng, 0.01), gauss(rng, 0.01));
    let push = if rng.random::<bool>() { mm } else { -mm };
    let second = Plane::<Camera>::new(exp(&tilt) * s.plane.normal, s.plane.offset + push).unwrap();
    let steady = rng.random::<bool>();
    let other = Intrinsics {
        fx: s.camera.fx * between(rng, 0.97, 1.03),
        cx: s.camera.cx + gauss(rng, 8.0),
        cy: s.camera.cy + gauss(rng, 8.0),
        ..s.camera
    };
    let mut out = Vec::new();
    for i in 0..count {
        let rig = if flaw == Flaw::OtherRig && wrong[i] { &other } else { &s.camera };
        let mut view = s.board(rng, &s.camera, rig, i);
        let pose = &s.boards[i];
        let pixels = match flaw {
            _ if !wrong[i] => s.stripe(&s.plane, pose, PEAKS),
            Flaw::Moved => {
                let d = Vec3::new(gauss(rng, 0.5), gauss(rng, 0.5), gauss(rng, 1.0));
                let turn = exp(&Vec3::new(gauss(rng, 1e-3), gauss(rng, 1e-3), 0.0));
                s.stripe(&s.plane, &Rigid::new(turn * pose.rotation, pose.translation + d * mm), PEAKS)
            }
            Flaw::Reflection => {
                let off = if steady { push } else { gauss(rng, 10.0) * s.pixel_mm };
                let beside = Plane::<Camera>::new(s.plane.normal, s.plane.offset + off).unwrap();
                let (true_share, false_share) = (between(rng, 0.3, 1.0), between(rng, 0.3, 1.0));
                let mut p = s.stripe(&s.plane, pose, PEAKS);
                p.retain(|_| rng.random::<f64>() < true_share);
                let mut q = s.stripe(if steady { &second } else { &beside }, pose, PEAKS);
                q.retain(|_| rng.random::<f64>() < false_share);
                p.extend(q);
                p
            }
            Flaw::OtherRig => {
                let line = s.line(&second, pose, PEAKS);
                line.iter().filter_map(|p| other.pixel_from_point(p)).collect()
            }
            Flaw::Pushed => s.stripe(&second, pose, PEAKS),
            Flaw::Broken => {
                let n = s.plane.normal.xy().normalize();
                let bias = gauss(rng, 0.2 * size_px.min(10.0));
                let mut p = s.stripe(&s.plane, pose, PEAKS);
                for piece in p.chunks_mut(15) {
                    let off = bias + gauss(rng, 0.2 * size_px.min(10.0));
                    piece.iter_mut().for_each(|q| *q += n * off);
                }
                let keep = between(rng, 0.3, 1.0);
                p.chunks(15).filter(|_| rng.random::<f64>() < keep).flatten().copied().collect()
            }
            Flaw::None => unreachable!(),
        };
        view.peaks = s.peaks(rng, pixels);
        out.push(view);
    }
    out
}
