//! In: the reference pictures with their truth. Out: how well boards are found and cameras calibrated.
//! Frame and unit: pixels, mm. Needs SHEETLIGHT_REFERENCE; says so loudly where it is missing.

use sheetlight::calibrate::boards::{FindOptions, find};
use sheetlight::camera::Intrinsics;
use sheetlight::geometry::{Board, Camera, Rigid};
use sheetlight::recording::Recording;
use std::path::PathBuf;

fn reference() -> Option<PathBuf> {
    let found = std::env::var_os("SHEETLIGHT_REFERENCE").map(PathBuf::from).filter(|p| p.is_dir());
    if found.is_none() {
        eprintln!("SKIPPED: SHEETLIGHT_REFERENCE does not name the folder of reference data");
    }
    found
}

fn truth(reference: &std::path::Path, set: &str) -> (Intrinsics, Vec<Rigid<Camera, Board>>) {
    let path = reference.join("rendered/truth/public").join(set).join("truth.json");
    let t: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let k = &t["intrinsics"];
    let f = |name: &str| k[name].as_f64().unwrap();
    let d: Vec<f64> = serde_json::from_value(k["distortion_k1_k2_p1_p2_k3"].clone()).unwrap();
    let camera = Intrinsics {
        fx: f("fx"),
        fy: f("fy"),
        cx: f("cx"),
        cy: f("cy"),
        skew: 0.0,
        distortion: d.try_into().unwrap(),
        width: 640,
        height: 480,
    };
    (camera, serde_json::from_value(t["camera_T_board"].clone()).unwrap())
}

/// Corner errors of a set against its truth: rms px, rms over reported sigma, corners in all.
fn corner_errors(set: &str, reference: &std::path::Path) -> (f64, f64, Vec<usize>) {
    let recording = Recording::open(&reference.join("rendered/inputs/public").join(set)).unwrap();
    let (camera, poses) = truth(reference, set);
    let board = recording.meta.board.clone().unwrap();
    let features = board.features();
    let (mut sum, mut normalised, mut counts) = (0.0, 0.0, Vec::new());
    for (frame, pose) in recording.meta.frames.iter().zip(&poses) {
        let image = recording.picture(frame.ambient.as_ref().unwrap()).unwrap();
        let view = find(&image, &board, &FindOptions::default()).unwrap();
        let mut own = 0.0;
        for p in &view.points {
            let e = p.pixel - camera.pixel_from_point(&pose.point(&features[p.feature_id])).unwrap();
            assert!(e.norm() < 0.5, "{:?} corner {}: {e:?}", frame.ambient, p.feature_id);
            own += e.norm_squared();
            normalised += e.norm_squared() / p.sigma_px.powi(2);
        }
        sum += own;
        let n = view.points.len();
        let blur = view.points.iter().map(|p| p.sigma_px).sum::<f64>() / n as f64;
        eprintln!("{:?}: {n} corners, rms {:.4} px, sigma {blur:.4}", frame.ambient, (own / (2 * n) as f64).sqrt());
        counts.push(n);
    }
    let n = 2.0 * counts.iter().sum::<usize>() as f64;
    eprintln!("{set}: rms {:.4} px, over sigma {:.3}", (sum / n).sqrt(), (normalised / n).sqrt());
    ((sum / n).sqrt(), (normalised / n).sqrt(), counts)
}

#[test]
fn chessboard_corners_lie_where_the_truth_puts_them() {
    let Some(reference) = reference() else { return };
    let (rms, _, counts) = corner_errors("intrinsics", &reference);
    assert!(counts.iter().all(|n| *n == 54) && rms < 0.015);
}

#[test]
fn charuco_corners_lie_where_the_truth_puts_them() {
    let Some(reference) = reference() else { return };
    let (rms, _, counts) = corner_errors("intrinsics_charuco", &reference);
    assert!(counts.len() == 16 && counts.iter().all(|n| *n >= 30) && rms < 0.03);
}
