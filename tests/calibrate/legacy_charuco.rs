//! ChArUco boards as OpenCV drew them before 4.6 (even number of rows: the first square is white), against the
//! corners that OpenCV itself finds with its legacy pattern, in pixels.

use sheetlight::calibrate::boards::{FindOptions, find};
use sheetlight::raster::{Channel, load};
use sheetlight::recording::BoardSpec;
use std::collections::BTreeMap;
use std::path::Path;

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
        for p in &view.points {
            let [x, y] = theirs[&p.feature_id];
            let off = (p.pixel.x - x).hypot(p.pixel.y - y);
            assert!(off < 0.1, "{name}: corner {} is {off:.3} px from OpenCV's", p.feature_id);
        }
    }
}
