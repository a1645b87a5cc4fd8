//! In: random stations with known truth. Out: whether the hand-eye calibration's errors are what it
//! says they are, and whether wrong input is found and named.
//! Frame and unit: mm, rad, px.

use nalgebra::{DMatrix, DVector, SMatrix};
use rand::{Rng, SeedableRng, seq::SliceRandom};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use sheetlight::calibrate::hand_eye::{HandEyeFit, HandEyeOptions, Mount, solve};
use sheetlight::calibrate::hand_eye_closed::{Chain, Far, Near, Pair};
use sheetlight::calibrate::measured_pose::{INTRINSIC_NAMES, SeenBoard, changed, measure};
use sheetlight::camera::Intrinsics;
use sheetlight::geometry::{Board, Camera, Rigid, Vec2, Vec3, exp};

fn gauss(rng: &mut Pcg64, sigma: f64) -> f64 {
    let z: f64 = StandardNormal.sample(rng);
    z * sigma
}

fn gauss3(rng: &mut Pcg64, sigma: f64) -> Vec3 {
    Vec3::new(gauss(rng, sigma), gauss(rng, sigma), gauss(rng, sigma))
}

fn between(rng: &mut Pcg64, low: f64, high: f64) -> f64 {
    low + (high - low) * rng.random::<f64>()
}

struct Station {
    camera: Intrinsics,
    truth: Chain,
    mount: Mount,
    /// True near_from_far.
    poses: Vec<Rigid<Near, Far>>,
    points: Vec<Vec3>,
}

/// A camera that looks at a 9x6 board from `count` sides.
fn station(rng: &mut Pcg64, mount: Mount, count: usize) -> Station {
    let f = between(rng, 500.0, 900.0);
    let camera = Intrinsics {
        fx: f,
        fy: f * between(rng, 0.99, 1.01),
        cx: between(rng, 300.0, 340.0),
        cy: between(rng, 220.0, 260.0),
        skew: 0.0,
        distortion: [between(rng, -0.15, 0.0), between(rng, 0.0, 0.1), gauss(rng, 5e-4), gauss(rng, 5e-4), 0.0],
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
struct Noise {
    mm: f64,
    deg: f64,
    px: f64,
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

fn pairs(rng: &mut Pcg64, s: &Station, noise: Noise, believed: &Intrinsics) -> Vec<Pair> {
    s.poses
        .iter()
        .enumerate()
        .map(|(i, pose)| {
            let true_board = s.truth.expected(pose);
            let pixels: Vec<Vec2> = s
                .points
                .iter()
                .map(|p| {
                    s.camera.pixel_from_point(&true_board.point(p)).unwrap()
                        + Vec2::new(gauss(rng, noise.px), gauss(rng, noise.px))
                })
                .collect();
            let seen = SeenBoard {
                name: format!("picture {i}"),
                points: s.points.clone(),
                pixels,
                sigmas_px: vec![1.0; s.points.len()],
            };
            Pair { near_from_far: read(rng, s, pose, noise), seen: measure(&seen, believed, &true_board).unwrap() }
        })
        .collect()
}

fn run(s: &Station, pairs: &[Pair], camera_covariance: &SMatrix<f64, 9, 9>) -> sheetlight::fault::Result<HandEyeFit> {
    solve(pairs, s.mount, camera_covariance, &s.camera, &HandEyeOptions::default())
}

/// Error of the 12 numbers as a step from the truth.
fn error(found: &Chain, truth: &Chain) -> DVector<f64> {
    let r = |a: &nalgebra::Matrix3<f64>, b: &nalgebra::Matrix3<f64>| sheetlight::geometry::log(&(a * b.transpose()));
    let (x, w) = (&found.near_from_camera, &found.far_from_board);
    let (tx, tw) = (&truth.near_from_camera, &truth.far_from_board);
    let parts = [
        x.translation - tx.translation,
        r(&x.rotation, &tx.rotation),
        w.translation - tw.translation,
        r(&w.rotation, &tw.rotation),
    ];
    DVector::from_iterator(12, parts.iter().flat_map(|p| p.iter().copied()))
}

/// Cramer-Rao bound of the whole joint problem (12 unknowns and six for every robot pose), from
/// numerical derivatives of the pixels: shares nothing with the solver.
fn bound(s: &Station, noise: Noise) -> DMatrix<f64> {
    let mut information = DMatrix::<f64>::zeros(12, 12);
    let v = |d: &[f64; 18], i: usize| Vec3::new(d[i], d[i + 1], d[i + 2]);
    for pose in &s.poses {
        let pixels = |d: &[f64; 18]| -> DVector<f64> {
            let x = Rigid::<Near, Camera>::new(
                exp(&v(d, 3)) * s.truth.near_from_camera.rotation,
                s.truth.near_from_camera.translation + v(d, 0),
            );
            let w = Rigid::<Far, Board>::new(
                exp(&v(d, 9)) * s.truth.far_from_board.rotation,
                s.truth.far_from_board.translation + v(d, 6),
            );
            let m = match s.mount {
                Mount::EyeToHand => Rigid::new(exp(&v(d, 15)) * pose.rotation, pose.translation + v(d, 12)),
                Mount::EyeInHand => {
                    let p = pose.inverse();
                    Rigid::<Far, Near>::new(exp(&v(d, 15)) * p.rotation, p.translation + v(d, 12)).inverse()
                }
            };
            let t = x.inverse() * m * w;
            DVector::from_iterator(
                s.points.len() * 2,
                s.points.iter().flat_map(|p| {
                    let q = s.camera.pixel_from_point(&t.point(p)).unwrap();
                    [q.x, q.y]
                }),
            )
        };
        let mut j = DMatrix::<f64>::zeros(s.points.len() * 2, 18);
        for c in 0..18 {
            let h = if c % 6 < 3 { 1e-4 } else { 1e-6 };
            let (mut a, mut b) = ([0.0; 18], [0.0; 18]);
            (a[c], b[c]) = (h, -h);
            j.set_column(c, &((pixels(&a) - pixels(&b)) / (2.0 * h)));
        }
        let mut h = j.transpose() * j / (noise.px * noise.px);
        for c in 0..6 {
            let sigma = if c < 3 { noise.mm } else { noise.deg.to_radians() };
            h[(12 + c, 12 + c)] += 1.0 / (sigma * sigma);
        }
        let local = h.view((12, 12), (6, 6)).into_owned().try_inverse().unwrap();
        let mixed = h.view((0, 12), (12, 6)).into_owned();
        information += h.view((0, 0), (12, 12)).into_owned() - &mixed * local * mixed.transpose();
    }
    information.try_inverse().unwrap()
}

const LEVELS: [Noise; 4] = [
    Noise { mm: 0.02, deg: 0.004, px: 0.03 },
    Noise { mm: 0.05, deg: 0.02, px: 0.05 },
    Noise { mm: 0.05, deg: 0.02, px: 0.2 },
    Noise { mm: 0.3, deg: 0.06, px: 0.1 },
];

#[test]
fn errors_are_what_the_report_says_and_near_the_bound() {
    for mount in [Mount::EyeInHand, Mount::EyeToHand] {
        let mut over_sigma = [0.0; 12];
        let mut over_bound = [0.0; 12];
        let mut n = 0.0;
        for k in 0..100 {
            let rng = &mut Pcg64::seed_from_u64(1000 + k);
            let s = station(rng, mount, 13);
            let noise = LEVELS[k as usize % LEVELS.len()];
            let found = run(&s, &pairs(rng, &s, noise, &s.camera), &SMatrix::zeros()).unwrap();
            assert!(found.pairs.iter().filter(|p| !p.used).count() <= 1, "station {k}: good pairs were left out");
            let e = error(&found.chain, &s.truth);
            let b = bound(&s, noise);
            for i in 0..12 {
                over_sigma[i] += e[i] * e[i] / found.covariance[(i, i)];
                over_bound[i] += e[i] * e[i] / b[(i, i)];
            }
            n += 1.0;
        }
        let rms = |a: [f64; 12]| a.map(|x: f64| (x / n).sqrt());
        let (s, b) = (rms(over_sigma), rms(over_bound));
        println!("{mount:?}: error over sigma {s:.3?}\n  error over bound {b:.3?}");
        assert!(s.iter().all(|x| (0.8..=1.25).contains(x)), "{mount:?} error over sigma {s:?}");
        let whole = (b.iter().map(|x| x * x).sum::<f64>() / 12.0).sqrt();
        assert!(whole <= 1.15, "{mount:?} error over bound {b:?}");
    }
}

/// The camera's own error is larger than the robot's here: a report that forgets it would fail.
#[test]
fn the_cameras_uncertainty_reaches_the_report() {
    let sigma = [0.6, 0.6, 0.4, 0.4, 2e-3, 1e-3, 1e-4, 1e-4, 1e-3];
    assert_eq!(sigma.len(), INTRINSIC_NAMES.len());
    let covariance = SMatrix::<f64, 9, 9>::from_diagonal(&nalgebra::SVector::from(sigma).map(|s: f64| s * s));
    let mut over = [0.0; 12];
    let mut camera_exact = [0.0; 12];
    for k in 0..100 {
        let rng = &mut Pcg64::seed_from_u64(5000 + k);
        let s = station(rng, Mount::EyeInHand, 13);
        let wrong = nalgebra::SVector::<f64, 9>::from_fn(|i, _| gauss(rng, sigma[i]));
        let believed = changed(&s.camera, &wrong);
        let p = pairs(rng, &s, LEVELS[0], &believed);
        let found = solve(&p, s.mount, &covariance, &believed, &HandEyeOptions::default()).unwrap();
        let e = error(&found.chain, &s.truth);
        for i in 0..12 {
            over[i] += e[i] * e[i] / found.covariance[(i, i)] / 100.0;
            camera_exact[i] += e[i] * e[i] / found.covariance_camera_exact[(i, i)] / 100.0;
        }
    }
    let over = over.map(f64::sqrt);
    println!("with the camera's part {over:.3?}, without {:.2?}", camera_exact.map(f64::sqrt));
    assert!(over.iter().all(|x| (0.8..=1.25).contains(x)), "{over:?}");
    assert!(camera_exact.iter().sum::<f64>().sqrt() > 5.0, "the test must be able to fail");
}

#[test]
fn a_fifth_of_wrong_pairs_is_found_and_named() {
    for k in 0..30 {
        let rng = &mut Pcg64::seed_from_u64(7000 + k);
        let s = station(rng, Mount::EyeInHand, 15);
        let mut p = pairs(rng, &s, LEVELS[1], &s.camera);
        // Three pictures get each other's poses.
        let mut chosen: Vec<usize> = (0..p.len()).collect();
        chosen.shuffle(rng);
        let (a, b, c) = (chosen[0], chosen[1], chosen[2]);
        let kept = p[a].near_from_far;
        (p[a].near_from_far, p[b].near_from_far) = (p[b].near_from_far, p[c].near_from_far);
        p[c].near_from_far = kept;
        let found = run(&s, &p, &SMatrix::zeros()).unwrap();
        let mut wrong: Vec<usize> = (0..p.len()).filter(|&i| !found.pairs[i].used).collect();
        let mut expected = vec![a, b, c];
        expected.sort_unstable();
        wrong.sort_unstable();
        assert!(
            expected.iter().all(|i| wrong.contains(i)) && wrong.len() <= 4,
            "seed {k}: {wrong:?}, not {expected:?}"
        );
        let e = error(&found.chain, &s.truth);
        assert!((0..12).all(|i| e[i].abs() < 5.0 * found.covariance[(i, i)].sqrt()), "seed {k}: {e}");
    }
}

#[test]
fn the_order_of_the_samples_does_not_matter() {
    let rng = &mut Pcg64::seed_from_u64(1);
    let s = station(rng, Mount::EyeInHand, 13);
    let mut p = pairs(rng, &s, LEVELS[1], &s.camera);
    let first = run(&s, &p, &SMatrix::zeros()).unwrap();
    for _ in 0..5 {
        p.shuffle(rng);
        let again = run(&s, &p, &SMatrix::zeros()).unwrap();
        let e = error(&again.chain, &first.chain);
        assert!(e.amax() < 1e-6, "{e}");
    }
}

/// What is wrong must be said in words: the fault's text holds `word`.
fn refused(s: &Station, p: &[Pair], word: &str) {
    match run(s, p, &SMatrix::zeros()) {
        Ok(f) => panic!("accepted; the robot scatters by {:?}", f.noise),
        Err(e) => assert!(e.to_string().contains(word), "'{word}' is not in: {e}"),
    }
}

#[test]
fn wrong_input_is_refused_with_its_name() {
    for seed in 0..5 {
        let rng = &mut Pcg64::seed_from_u64(80 + seed);
        let s = station(rng, Mount::EyeInHand, 12);
        let good = pairs(rng, &s, LEVELS[1], &s.camera);
        let with_poses = |f: &dyn Fn(usize) -> Rigid<Near, Far>| -> Vec<Pair> {
            (0..12).map(|i| Pair { near_from_far: f(i), seen: good[i].seen.clone() }).collect()
        };
        refused(&s, &with_poses(&|i| good[11 - i].near_from_far), "reverse order");
        refused(&s, &with_poses(&|i| good[(i + 1) % 12].near_from_far), "1 places earlier");
        let metres = |t: &Rigid<Near, Far>| {
            let p = t.inverse();
            Rigid::<Far, Near>::new(p.rotation, p.translation / 1000.0).inverse()
        };
        refused(&s, &with_poses(&|i| metres(&good[i].near_from_far)), "metres");
        let inverted = |t: &Rigid<Near, Far>| Rigid::new(t.inverse().rotation, t.inverse().translation);
        refused(&s, &with_poses(&|i| inverted(&good[i].near_from_far)), "inverted");
        refused(&s, &with_poses(&|i| good[if i == 5 { 4 } else { i }].near_from_far), "duplicate");
        let mut shuffled: Vec<usize> = (0..12).collect();
        shuffled.shuffle(rng);
        refused(&s, &with_poses(&|i| good[shuffled[i]].near_from_far), "do not belong together");
    }
}

#[test]
fn a_single_axis_and_a_wrong_board_are_refused() {
    let rng = &mut Pcg64::seed_from_u64(90);
    let mut s = station(rng, Mount::EyeInHand, 10);
    let p = pairs(rng, &s, LEVELS[0], &s.camera);
    // Squares 3 % smaller than stated.
    let mut small = p.clone();
    for pair in &mut small {
        let t = pair.seen.camera_from_board;
        pair.seen.camera_from_board = Rigid::new(t.rotation, t.translation * 1.03);
    }
    refused(&s, &small, "square");
    let first = s.truth.expected(&s.poses[0]);
    let axis = Vec3::new(0.3, 0.2, 0.9).normalize();
    s.poses = (0..10)
        .map(|i| {
            let turn: Rigid<Camera, Camera> = Rigid::from_vectors(&(axis * (f64::from(i) * 0.1 - 0.45)), Vec3::zeros());
            let centre = first.point(&Vec3::new(60.0, 37.5, 0.0));
            let about: Rigid<Camera, Camera> = Rigid::new(turn.rotation, centre - turn.rotation * centre);
            s.truth.near_from_camera * (about * first) * s.truth.far_from_board.inverse()
        })
        .collect();
    let p = pairs(rng, &s, LEVELS[0], &s.camera);
    refused(&s, &p, "one axis");
}
