//! In: boards of 11x8 inner corners, completely in view, with random tilts, distances, light, blur and noise. Out:
//! the test that every one of them is found at its true position.
//! Frame and unit: pixels, mm.

use super::trials::{facing, picture_by};
use crate::calibrate::boards::{FindOptions, find};
use crate::camera::{Distortion, Intrinsics};
use crate::geometry::{Board, Camera, Rigid, Vec2, Vec3};
use crate::raster::Image;
use crate::recording::BoardSpec;
use rand::{Rng, SeedableRng};
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use std::f64::consts::{PI, TAU};

const WIDTH: usize = 640;
const HEIGHT: usize = 480;

/// Smallest squares and cells in the test. A corner's fit uses four quarters of a square. A marker's cell must be
/// visible despite the blur: of cells narrower than twice its sigma, every other one keeps less than a third of its
/// contrast.
const LEAST_SQUARE_PX: f64 = 9.0;
const LEAST_CELL_PX: f64 = 2.2;
const LEAST_CELL_BLURS: f64 = 2.0;

fn camera() -> Intrinsics {
    let (width, height) = (WIDTH as u32, HEIGHT as u32);
    let distortion = Distortion::default();
    Intrinsics { fx: 600.0, fy: 600.0, cx: 319.5, cy: 239.5, skew: 0.0, distortion, width, height }
}

/// A pose with the entire board in view, and its smallest step between corners, px.
fn pose(board: &BoardSpec, rng: &mut Pcg64) -> (Rigid<Camera, Board>, f64) {
    let [x0, y0, x1, y1] = board.outline();
    let seen = |pose: &Rigid<Camera, Board>, x: f64, y: f64| {
        let p = camera().pixel_from_point(&pose.point(&Vec3::new(x, y, 0.0)))?;
        (p.x > 4.0 && p.y > 4.0 && p.x < WIDTH as f64 - 5.0 && p.y < HEIGHT as f64 - 5.0).then_some(p)
    };
    loop {
        let (tilt, about, roll) =
            (rng.random_range(0.0..1.0f64), rng.random_range(0.0..TAU), rng.random_range(-PI..PI));
        let lean = crate::geometry::exp(&Vec3::new(tilt * about.cos(), tilt * about.sin(), 0.0));
        let lying = facing(board, Vec3::new(0.0, 0.0, roll), rng.random_range(150.0..450.0));
        let aside = Vec3::new(rng.random_range(-90.0..90.0), rng.random_range(-70.0..70.0), lying.translation.z);
        let centre = board.features().iter().sum::<Vec3>() / 88.0;
        let rotation = lean * lying.rotation;
        let pose = Rigid::new(rotation, aside - rotation * centre);
        if [(x0, y0), (x1, y0), (x1, y1), (x0, y1)].iter().any(|(x, y)| seen(&pose, *x, *y).is_none()) {
            continue;
        }
        let places: Vec<Vec2> = board.features().iter().map(|f| seen(&pose, f.x, f.y).expect("inside")).collect();
        let across = (0..88).filter(|k| k % 11 < 10).map(|k| (places[k] - places[k + 1]).norm());
        let down = (0..77).map(|k| (places[k] - places[k + 11]).norm());
        return (pose, across.chain(down).fold(f64::INFINITY, f64::min));
    }
}

/// The picture with light from one side, defocused by `blur` px, with noise.
fn seen_in(drawn: &Image, blur: f64, rng: &mut Pcg64) -> Image {
    let (black, white) = (rng.random_range(8.0..50.0f64), rng.random_range(90.0..235.0f64));
    let slope = [rng.random_range(-0.8..0.8), rng.random_range(-0.8..0.8)];
    let mut levels: Vec<f64> = drawn.to_f32().iter().map(|v| f64::from(*v)).collect();
    for (k, v) in levels.iter_mut().enumerate() {
        let at = [(k % WIDTH) as f64 / WIDTH as f64 - 0.5, (k / WIDTH) as f64 / HEIGHT as f64 - 0.5];
        *v = (black + (*v - 20.0) / 170.0 * (white - black)) * (1.0 + slope[0] * at[0] + slope[1] * at[1]).max(0.05);
    }
    let reach = (3.0 * blur).ceil() as isize;
    let weights: Vec<f64> = (-reach..=reach).map(|i| (-0.5 * (i as f64 / blur).powi(2)).exp()).collect();
    let all: f64 = weights.iter().sum();
    for [dx, dy] in [[1, 0], [0, 1]] {
        let old = levels.clone();
        for (k, v) in levels.iter_mut().enumerate() {
            let (x, y) = ((k % WIDTH) as isize, (k / WIDTH) as isize);
            let at = |i: isize| {
                let x = (x + i * dx).clamp(0, WIDTH as isize - 1) as usize;
                old[(y + i * dy).clamp(0, HEIGHT as isize - 1) as usize * WIDTH + x]
            };
            *v = (-reach..=reach).zip(&weights).map(|(i, w)| w * at(i)).sum::<f64>() / all;
        }
    }
    let noise = Normal::new(0.0, rng.random_range(0.3..5.0)).unwrap();
    let noisy = levels.iter().map(|v| (v + noise.sample(rng)).round().clamp(0.0, 255.0) as u8).collect();
    Image::from_u8(WIDTH as u32, HEIGHT as u32, noisy)
}

fn board(seed: u64) -> BoardSpec {
    if seed.is_multiple_of(4) {
        let dictionary = "DICT_5X5_250".into();
        return BoardSpec::Charuco {
            squares: [12, 9],
            square_mm: 10.0,
            marker_mm: 7.0,
            dictionary,
            first_id: 0,
            first_square: None,
            border_mm: 7.0,
        };
    }
    let first_square = if seed.is_multiple_of(2) { "black" } else { "white" }.into();
    BoardSpec::Chessboard { inner_corners: [11, 8], square_mm: 10.0, border_mm: 7.0, first_square }
}

#[test]
fn every_board_that_is_whole_and_in_view_is_found() {
    let pictures = if std::env::var_os("SHEETLIGHT_LONG").is_some() { 400 } else { 40 };
    let mut missed = Vec::new();
    for seed in 0..pictures {
        let rng = &mut Pcg64::seed_from_u64(seed);
        let board = board(seed);
        let charuco = matches!(board, BoardSpec::Charuco { .. });
        let blur = rng.random_range(0.2..1.6);
        let least = if charuco { LEAST_CELL_PX.max(LEAST_CELL_BLURS * blur) * 10.0 } else { LEAST_SQUARE_PX };
        // Only small chessboards: large ones are easy.
        let wanted = least..if charuco { f64::INFINITY } else { 16.0 };
        let (pose, step) =
            std::iter::repeat_with(|| pose(&board, rng)).find(|(_, step)| wanted.contains(step)).expect("endless");
        let image = seen_in(&picture_by(&camera(), &board, &pose), blur, rng);
        let view = match find(&image, &board, &FindOptions::default()) {
            Ok(view) => view,
            Err(e) => {
                missed.push(format!("{seed} (squares of {step:.1} px, blur {blur:.2} px): {e}"));
                continue;
            }
        };
        let features = board.features();
        let far = view
            .points
            .iter()
            .map(|p| (camera().pixel_from_point(&pose.point(&features[p.feature_id])).unwrap() - p.pixel).norm());
        // Blurred squares of 9 px under noise of 5 levels: a corner's sigma is 0.4 px.
        let off = far.fold(0.0, f64::max);
        if off > 2.0 || view.points.len() < 80 {
            missed.push(format!("{seed} (squares of {step:.1} px): {} corners, {off:.2} px off", view.points.len()));
        }
    }
    println!("{} of {pictures} pictures read", pictures as usize - missed.len());
    assert!(missed.is_empty(), "{} of {pictures}: {missed:#?}", missed.len());
}
