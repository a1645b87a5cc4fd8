//! In: a generator, levels of noise. Out: random stations that look at a board from many sides, and what robot
//! and camera say of it.
//! Frame and unit: mm, rad, px.

use super::judge::{between, gauss, gauss3};
use rand_pcg::Pcg64;
use sheetlight::calibrate::hand_eye::closed::{Chain, Far, Near, Pair};
use sheetlight::calibrate::hand_eye::options::Mount;
use sheetlight::calibrate::measured_pose::{SeenBoard, measure};
use sheetlight::camera::Intrinsics;
use sheetlight::geometry::{Board, Camera, Rigid, Vec2, Vec3, exp};

pub struct Station {
    pub camera: Intrinsics,
    pub truth: Chain,
    pub mount: Mount,
    /// True near_from_far.
    pub poses: Vec<Rigid<Near, Far>>,
    pub points: Vec<Vec3>,
}

/// A camera that looks at a 9x6 board from `count` sides.
pub fn station(rng: &mut Pcg64, mount: Mount, count: usize) -> Station {
    let f = between(rng, 500.0, 900.0);
    let camera = Intrinsics {
        fx: f,
        fy: f * between(rng, 0.99, 1.01),
        cx: between(rng, 300.0, 340.0),
        cy: between(rng, 220.0, 260.0),
        skew: 0.0,
        distortion: [between(rng, -0.15, 0.0), between(rng, 0.0, 0.1), gauss(rng, 5e-4), gauss(rng, 5e-4), 0.0].into(),
        width: 640,
        height: 480,
    };
    let points: Vec<Vec3> = (0..54).map(|i| Vec3::new(f64::from(i % 9) * 15.0, f64::from(i / 9) * 15.0, 0.0)).collect();
    let truth = Chain {
        near_from_camera: Rigid::from_vectors(&gauss3(rng, 1.0), gauss3(rng, 60.0)),
        far_from_board: Rigid::from_vectors(&gauss3(rng, 1.0), gauss3(rng, 300.0)),
    };
    let poses = (0..count)
        .map(|_| {
            let distance = f * between(rng, 0.32, 0.5);
            let turn = exp(&Vec3::new(0.0, 0.0, between(rng, -0.8, 0.8)))
                * exp(
                    &(gauss3(rng, 1.0).component_mul(&Vec3::new(1.0, 1.0, 0.0)).normalize() * between(rng, 0.15, 0.6))
                );
            let centre = Vec3::new(gauss(rng, 6.0), gauss(rng, 6.0), distance);
            let camera_from_board: Rigid<Camera, Board> = Rigid::new(turn, centre - turn * Vec3::new(60.0, 37.5, 0.0));
            truth.near_from_camera * camera_from_board * truth.far_from_board.inverse()
        })
        .collect();
    Station { camera, truth, mount, poses, points }
}

#[derive(Clone, Copy)]
pub struct Noise {
    pub mm: f64,
    pub deg: f64,
    pub px: f64,
}

/// The robot's reading of a pose: noise of base_from_flange, translation and rotation apart.
fn read(rng: &mut Pcg64, s: &Station, pose: &Rigid<Near, Far>, noise: Noise) -> Rigid<Near, Far> {
    let blur = |rng: &mut Pcg64, rotation, translation: Vec3| {
        let turn = exp(&gauss3(rng, noise.deg.to_radians()));
        (turn * rotation, translation + gauss3(rng, noise.mm))
    };
    match s.mount {
        Mount::EyeToHand => {
            let (r, t) = blur(rng, pose.rotation, pose.translation);
            Rigid::new(r, t)
        }
        Mount::EyeInHand => {
            let p = pose.inverse();
            let (r, t) = blur(rng, p.rotation, p.translation);
            Rigid::<Far, Near>::new(r, t).inverse()
        }
    }
}

/// Pixels of the station's features at a pose, where they truly lie at `places`.
pub fn seen(rng: &mut Pcg64, s: &Station, i: usize, px: f64, places: &[Vec3]) -> SeenBoard {
    let true_board = s.truth.expected(&s.poses[i]);
    let pixels: Vec<Vec2> = places
        .iter()
        .map(|p| s.camera.pixel_from_point(&true_board.point(p)).unwrap() + Vec2::new(gauss(rng, px), gauss(rng, px)))
        .collect();
    let sigmas_px = vec![1.0; s.points.len()];
    SeenBoard { name: format!("picture {i}"), points: s.points.clone(), pixels, sigmas_px }
}

pub fn pairs(rng: &mut Pcg64, s: &Station, noise: Noise, believed: &Intrinsics) -> Vec<Pair> {
    seen_pairs(rng, s, noise, believed, &s.points).into_iter().map(|(_, pair)| pair).collect()
}

/// The same with a board whose features lie at `places`, measured as drawn, and what was seen of it.
pub fn seen_pairs(
    rng: &mut Pcg64,
    s: &Station,
    noise: Noise,
    believed: &Intrinsics,
    places: &[Vec3],
) -> Vec<(SeenBoard, Pair)> {
    let pair = |i: usize| {
        let seen = seen(rng, s, i, noise.px, places);
        let measured = measure(&seen, believed, &s.truth.expected(&s.poses[i])).unwrap();
        (seen, Pair::new(read(rng, s, &s.poses[i], noise), measured))
    };
    (0..s.poses.len()).map(pair).collect()
}

pub const LEVELS: [Noise; 4] = [
    Noise { mm: 0.02, deg: 0.004, px: 0.03 },
    Noise { mm: 0.05, deg: 0.02, px: 0.05 },
    Noise { mm: 0.05, deg: 0.02, px: 0.2 },
    Noise { mm: 0.3, deg: 0.06, px: 0.1 },
];
