//! In: the real height map of a plate of test shapes (SHEETLIGHT_REFERENCE). Out: judgement on shapes found by drawings
//! that know only their sizes: places, and heights above the plate as the reference's README gives them.
//! Frame and unit: the map's columns and rows in mm, z up; a fifth of the cells is missing.

use crate::common;
use nalgebra::{Matrix3, Matrix4, Vector3, Vector4};
use sheetlight::find::insert::locate::scene_of;
use sheetlight::find::{Drawing, Kind, Match, ModelOptions, SearchOptions, ShapeModel, find};
use sheetlight::geometry::{Rigid, Vec3};
use sheetlight::scan::grid;
use sheetlight::scan::{CloudPoint, GridOptions, HeightMap};

/// Cells of the map as it was recorded, mm.
const CELL: [f64; 2] = [0.215_850_83, 0.208_819_14];

fn decoded(text: &str) -> Vec<u8> {
    let value = |c: u8| match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        _ => 63,
    };
    let digits: Vec<u8> = text.bytes().filter(|&c| c != b'=').map(value).collect();
    let mut out = Vec::with_capacity(digits.len() * 3 / 4);
    for d in digits.chunks(4) {
        let word = d.iter().enumerate().fold(0u32, |w, (i, &v)| w | u32::from(v) << (18 - 6 * i));
        out.extend(&word.to_be_bytes()[1..d.len()]);
    }
    out
}

/// The map on square cells, as a scan's cloud would give it.
fn plate() -> Option<HeightMap> {
    let path = common::reference("the plate of test shapes")?.join("height_maps/blobs/image.json");
    let json: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let data = &json[0]["data"]["Data"];
    let width = data["Width"].as_u64().unwrap() as usize;
    let bytes = decoded(data["Pixels"]["data"].as_str().unwrap());
    let points: Vec<CloudPoint> = bytes
        .chunks_exact(2)
        .map(|b| u16::from_le_bytes([b[0], b[1]]))
        .enumerate()
        .filter(|(_, z)| *z != 0)
        .map(|(i, z)| {
            let (x, y) = ((i % width) as f64 * CELL[0], (i / width) as f64 * CELL[1]);
            CloudPoint {
                position: [x as f32, y as f32, 0.02 * f32::from(z)].into(),
                quality: 1.0,
                ..Default::default()
            }
        })
        .collect();
    let fixed = GridOptions { cell: Some(0.22), base_from_grid: Some(Rigid::identity()), ..Default::default() };
    Some(grid(&points, &fixed).unwrap())
}

fn cells(map: &HeightMap) -> impl Iterator<Item = Vec3> + '_ {
    (0..map.height).flat_map(move |y| (0..map.width).filter_map(move |x| map.point(x, y)))
}

/// The plate is bowed by 0.8 mm; the README's heights stand on the plane of its upper part (rows above 430).
fn base(map: &HeightMap) -> Vector3<f64> {
    let mut plane = Vector3::new(0.0, 0.0, 200.8);
    for _ in 0..12 {
        let (mut a, mut b) = (Matrix3::zeros(), Vector3::zeros());
        for p in cells(map).filter(|p| p.y < 90.0) {
            let j = Vector3::new(p.x, p.y, 1.0);
            if (p.z - plane.dot(&j)).abs() < 0.3 {
                a += j * j.transpose();
                b += j * p.z;
            }
        }
        plane = a.try_inverse().unwrap() * b;
    }
    plane
}

/// Cells of the map inside the drawing at a match, with their height above the plate.
fn inside(map: &HeightMap, plane: &Vector3<f64>, drawing: &Drawing, found: &Match) -> Vec<Vec3> {
    let faces = drawing.faces();
    let (s, c) = found.pose.angle.sin_cos();
    let (x, y) = ((found.pose.x + 0.5) * map.cell, (found.pose.y + 0.5) * map.cell);
    cells(map)
        .filter(|p| faces[0].material(c * (p.x - x) + s * (p.y - y), c * (p.y - y) - s * (p.x - x)))
        .map(|p| Vec3::new(p.x, p.y, p.z - plane.dot(&Vector3::new(p.x, p.y, 1.0))))
        .collect()
}

fn median(mut v: Vec<f64>) -> f64 {
    v.sort_unstable_by(f64::total_cmp);
    v[v.len() / 2]
}

fn search(map: &HeightMap, drawing: &Drawing, most: usize) -> Vec<Match> {
    let scene = scene_of(map, &[Kind::Height]).unwrap();
    let model = ShapeModel::from_drawing(drawing, map.cell, Kind::Height, &ModelOptions::default()).unwrap();
    let options = SearchOptions { max_matches: most, min_score: 0.6, max_overlap: 0.3, ..Default::default() };
    find(&scene, &model, &options).unwrap()
}

fn place(map: &HeightMap, m: &Match) -> [f64; 2] {
    [(m.pose.x + 0.5) * map.cell, (m.pose.y + 0.5) * map.cell]
}

/// Where a column and row of the recorded map lie, mm.
fn at(column: f64, row: f64) -> [f64; 2] {
    [column * CELL[0], row * CELL[1]]
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[test]
fn the_shapes_of_the_plate_are_found_at_their_heights() {
    let Some(map) = plate() else { return };
    let plane = base(&map);
    let heights = |d: &Drawing, m: &Match| median(inside(&map, &plane, d, m).iter().map(|p| p.z).collect());

    let bar = Drawing::parse("[[shape]]\nkind = \"rectangle\"\ncentre = [0, 0]\nsize = [31.2, 5.9]\n").unwrap();
    let bars = search(&map, &bar, 6);
    println!("{} bars", bars.len());
    // By eye: middle of each bar, column and row, and its direction.
    let seen =
        [(243.8, 116.4, 0.5), (230.0, 177.2, 23.0), (196.0, 232.6, 45.5), (143.3, 268.4, 67.8), (85.2, 283.7, 89.6)];
    for (column, row, turn) in seen {
        let m = bars.iter().find(|m| distance(place(&map, m), at(column, row)) < 1.0);
        let m = m.unwrap_or_else(|| panic!("the bar at {column} {row} was not found"));
        let off = (m.pose.angle.to_degrees() - turn + 90.0).rem_euclid(180.0) - 90.0;
        let z = heights(&bar, m);
        println!("bar at {turn} degrees: {off:+.2} degrees off, score {:.3}, {z:.3} mm high", m.score);
        assert!(off.abs() < 1.5, "{off}");
        assert!((4.98 - 0.1..=5.06 + 0.1).contains(&z), "bar: {z:.3} mm, README 4.98 to 5.06");
    }
    let star: String = (0..10)
        .map(|k| {
            let (s, c) = (f64::from(k) * 36f64.to_radians()).sin_cos();
            let r = if k % 2 == 0 { 10.2 } else { 5.4 };
            format!("[{:.3}, {:.3}], ", r * c, r * s)
        })
        .collect();
    let shapes = [
        ("square", "kind = \"rectangle\"\ncentre = [0, 0]\nsize = [17.7, 17.7]".into(), (425.2, 664.6), 4.66),
        ("disc", "kind = \"circle\"\ncentre = [0, 0]\nradius = 9.3".into(), (656.3, 527.3), 4.62),
        ("star", format!("kind = \"polygon\"\npoints = [{star}]"), (660.0, 668.0), 4.44),
    ];
    for (name, shape, (column, row), want) in shapes {
        let drawing = Drawing::parse(&format!("[[shape]]\n{shape}\n")).unwrap();
        let found = search(&map, &drawing, 12);
        let m = found.iter().find(|m| distance(place(&map, m), at(column, row)) < 1.0);
        let m = m.unwrap_or_else(|| panic!("the {name} was not found"));
        let z = heights(&drawing, m);
        println!("{name}: score {:.3}, {z:.3} mm high, sigma {:.3?} mm", m.score, m.sigma_mm.unwrap());
        assert!((z - want).abs() <= 0.1, "{name}: {z:.3} mm, README {want}");
    }

    let ball = Drawing::parse("[[shape]]\nkind = \"circle\"\ncentre = [0, 0]\nradius = 10.2\n").unwrap();
    let found = search(&map, &ball, 12);
    for m in &found {
        println!("round thing at {:.1?} mm, score {:.3}", place(&map, m), m.score);
    }
    let m = found.iter().find(|m| distance(place(&map, m), at(421.3, 529.3)) < 1.5).expect("the half ball");
    let (mut a, mut b) = (Matrix4::zeros(), Vector4::zeros());
    let points = inside(&map, &plane, &ball, m);
    // Its flank towards the shadow and its foot are badly seen: the cap above 5 mm gives the sphere.
    for p in points.iter().filter(|p| p.z > 5.0) {
        let j = Vector4::new(2.0 * p.x, 2.0 * p.y, 2.0 * p.z, 1.0);
        a += j * j.transpose();
        b += j * p.norm_squared();
    }
    let s = a.try_inverse().unwrap() * b;
    let radius = (s.w + s.xyz().norm_squared()).sqrt();
    let top = s.z + radius;
    println!("half ball: score {:.3}, top {top:.3} mm, radius {radius:.3} mm", m.score);
    assert!((top - 9.91).abs() <= 0.1, "top {top:.3} mm, README 9.91");
    assert!((radius - 10.67).abs() <= 0.1, "radius {radius:.3} mm, README 10.67");
}
