//! ChArUco boards as OpenCV drew them before 4.6 (even number of rows: the first square is white), against the
//! corners that OpenCV itself finds with its legacy pattern, in pixels.

use sheetlight::calibrate::boards::{FindOptions, find};
use sheetlight::calibrate::homography::homography;
use sheetlight::geometry::Vec2;
use sheetlight::raster::{Channel, load};
use sheetlight::recording::BoardSpec;
use std::collections::BTreeMap;
use std::path::Path;

fn rms(distances: impl Iterator<Item = f64>) -> f64 {
    let squares: Vec<f64> = distances.map(|d| d * d).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// How far points lie from what a flat board shows, px, rms.
fn off_a_plane(board: &[Vec2], pixels: &[Vec2]) -> f64 {
    let h = homography(board, pixels).unwrap();
    rms(board.iter().zip(pixels).map(|(b, p)| {
        let q = h * b.push(1.0);
        (Vec2::new(q.x / q.z, q.y / q.z) - p).norm()
    }))
}

#[test]
fn corners_are_those_of_opencvs_legacy_pattern() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/charuco_legacy");
    let all: serde_json::Value = serde_json::from_slice(&std::fs::read(folder.join("opencv.json")).unwrap()).unwrap();
    for (name, squares) in [("7x6", [7, 6]), ("8x6", [8, 6])] {
        let theirs: BTreeMap<usize, [f64; 2]> = serde_json::from_value(all["corners"][name].clone()).unwrap();
        let board = BoardSpec::Charuco {
            squares,
            square_mm: 15.0,
            marker_mm: 10.5,
            dictionary: "DICT_5X5_250".into(),
            first_id: 0,
            first_square: None,
            border_mm: 0.0,
        };
        let image = load(&folder.join(format!("{name}.jpg")), Channel::default(), 8).unwrap();
        let view = find(&image, &board, &FindOptions::default()).unwrap();
        assert!(view.begins_white, "{name}");
        assert!(view.points.len() >= theirs.len(), "{name}: {} of {} corners", view.points.len(), theirs.len());
        let both: Vec<_> = view.points.iter().map(|p| (p, Vec2::from(theirs[&p.feature_id]))).collect();
        let apart = rms(both.iter().map(|(p, theirs)| (p.pixel - theirs).norm()));
        let columns = squares[0] as usize - 1;
        let at = |id: usize| Vec2::new((id % columns) as f64, (id / columns) as f64);
        let board: Vec<Vec2> = both.iter().map(|(p, _)| at(p.feature_id)).collect();
        let own = off_a_plane(&board, &both.iter().map(|(p, _)| p.pixel).collect::<Vec<_>>());
        let opencv = off_a_plane(&board, &both.iter().map(|(_, theirs)| *theirs).collect::<Vec<_>>());
        println!("{name}: {apart:.3} px from OpenCV's; off a flat board: ours {own:.3} px, OpenCV's {opencv:.3} px");
        // The board is flat and the lens has no distortion: what is off a plane is the corner finder's error. Most of
        // the distance is OpenCV's own.
        assert!(own < 0.02 && opencv < 0.12, "{name}: {own:.3} and {opencv:.3} px off a flat board");
        assert!(apart < 1.25 * opencv, "{name}: corners are {apart:.3} px from OpenCV's, which are off by {opencv:.3}");
    }
}
