//! In: stops of either mount. Out: whether each residual's derivatives are its derivatives, and a camera that stands
//! still is calibrated as one on the flange is.
//! Frame and unit: mm, rad, px; residuals in sigmas.

use super::stations::{Cell, QUIET, calibrate, rig, stops};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use sheetlight::calibrate::hand_eye::closed::{Far, Near};
use sheetlight::calibrate::hand_eye::options::Mount;
use sheetlight::calibrate::joint::options::{JointOptions, Noise};
use sheetlight::calibrate::joint::shots::Shot;
use sheetlight::calibrate::joint::terms::Terms;
use sheetlight::calibrate::joint::unknowns::{Layout, State};
use sheetlight::calibrate::joint::volume::{apart, by_unknowns, expected, places, scanned, weights};
use sheetlight::geometry::{Base, Board, Camera, Flange, Rigid, Vec3};
use sheetlight::simulate::reported;

/// A camera in the base, the board on the flange: the same views of the same boards.
fn carried(cell: &Cell, mut shots: Vec<Shot>, views: &[Rigid<Camera, Board>], noise: [f64; 2]) -> (Vec<Shot>, State) {
    let x: Rigid<Base, Camera> = Rigid::from_vectors(&Vec3::new(2.6, 0.3, 0.5), Vec3::new(620.0, 40.0, 710.0));
    let w: Rigid<Flange, Board> = Rigid::from_vectors(&Vec3::new(0.2, -0.3, 0.6), Vec3::new(25.0, -30.0, 90.0));
    let mut rng = Pcg64::seed_from_u64(21);
    for (shot, view) in shots.iter_mut().zip(views) {
        let exact: Rigid<Base, Flange> = x * *view * w.inverse();
        shot.robot.as_mut().unwrap().pose = reported(&exact, noise[0], noise[1], &mut rng);
    }
    let mut truth = cell.truth(views);
    truth.near_from_camera = Rigid::<Near, Camera>::new(x.rotation, x.translation);
    truth.far_from_board = vec![Rigid::<Far, Board>::new(w.rotation, w.translation)];
    (shots, truth)
}

fn residuals(terms: &Terms<'_>, s: &State) -> Vec<f64> {
    let mut out = Vec::new();
    terms.visit(s, false, &mut |t| out.extend_from_slice(t.residual)).unwrap();
    out
}

#[test]
fn derivatives_are_derivatives_for_both_mounts() {
    let cell = Cell::new(&rig("slant45"), 3);
    let views = cell.views(3, 35.0, "joint 3");
    let still = stops(&cell, 3, 35.0, &QUIET, 3);
    let (moved, carried_truth) = carried(&cell, still.clone(), &views, [0.02, 0.004]);
    for (mount, shots, truth) in
        [(Mount::EyeInHand, &still, cell.truth(&views)), (Mount::EyeToHand, &moved, carried_truth)]
    {
        let layout = Layout { camera: (0..9).collect(), places: 1, shots: 3 };
        let mut terms =
            Terms { shots, mount, layout: &layout, noise: Noise::usual(), peak_sigma_mm: vec![], prior: None };
        terms.settle(&truth);
        let mut analytic = Vec::new();
        terms
            .visit(&truth, true, &mut |t| {
                for row in t.jacobian.chunks_exact(t.columns.len()) {
                    let mut all = vec![0.0; layout.width()];
                    t.columns.iter().zip(row).for_each(|(&c, x)| all[c] += x);
                    analytic.push(all);
                }
            })
            .unwrap();
        for c in 0..layout.width() {
            let h = match c {
                0..4 => 1e-3,
                4..9 => 1e-6,
                _ => 1e-6,
            };
            let at = |sign: f64| {
                let mut step = vec![0.0; layout.width()];
                step[c] = sign * h;
                residuals(&terms, &truth.moved(&layout, &step))
            };
            let (a, b) = (at(1.0), at(-1.0));
            for (i, row) in analytic.iter().enumerate() {
                let numeric = (a[i] - b[i]) / (2.0 * h);
                // The turn's residual is taken as small, which costs its own size.
                let off = (numeric - row[c]).abs();
                assert!(
                    off < 2e-3 * row.iter().fold(1.0f64, |a, x| a.max(x.abs())),
                    "{mount:?} residual {i} by {c}: {numeric} against {}",
                    row[c]
                );
            }
        }
    }
}

#[test]
fn a_scanned_point_follows_what_was_calibrated() {
    let cell = Cell::new(&rig("paper"), 6);
    let truth = cell.truth(&[]);
    let layout = Layout { camera: (0..9).collect(), places: 1, shots: 0 };
    for pixel in places(&truth, cell.working()).iter().step_by(37) {
        let j = by_unknowns(&truth, &layout, pixel).unwrap();
        for c in 0..layout.shared() {
            let h = if (4..9).contains(&c) { 1e-6 } else { 1e-5 };
            let at = |sign: f64| {
                let mut step = vec![0.0; layout.shared()];
                step[c] = sign * h;
                scanned(&truth.moved(&layout, &step), pixel).unwrap()
            };
            let off = ((at(1.0) - at(-1.0)) / (2.0 * h) - j.column(c)).norm();
            assert!(off < 1e-4 * (1.0 + j.column(c).norm()), "{pixel} by {c}: {off}");
        }
    }
}

#[test]
fn a_fixed_camera_and_a_carried_board_are_as_good() {
    let cell = Cell::new(&rig("paper"), 4);
    let views = cell.views(40, 40.0, "joint 4");
    let (shots, truth) = carried(&cell, stops(&cell, 40, 40.0, &QUIET, 4), &views, [0.02, 0.004]);
    let o = JointOptions { mount: Mount::EyeToHand, ..JointOptions::default() };
    let fit = calibrate(&cell, &shots, &o).unwrap();
    let lit = places(&truth, cell.working());
    let off = apart(&fit.state, &truth, &lit);
    let said = expected(&weights(&fit.state, &fit.layout, &lit), &fit.covariance);
    println!("carried board: off {off:.4} mm, expected {said:.4}; robot {:.4} mm", fit.noise.robot_mm);
    assert!(off < 0.04 && off < 2.5 * said, "{off} {said}");
    assert!((fit.noise.robot_mm / 0.02 - 1.0).abs() < 0.3, "{:?}", fit.noise);
}
