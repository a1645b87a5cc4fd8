//! In: real height maps of another sensor (SHEETLIGHT_REFERENCE), written as the files that other programs write.
//! Out: judgement on `import-map`: the same points whatever the format, parts found in them where they lie, nothing
//! guessed.
//! Frame and unit: the map's own frame, mm.

use crate::common::{reference, sheetlight, sheetlight_fails};
use base64::Engine;
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use serde_json::Value;
use sheetlight::raster::{Image, Kind, Says, save_png};
use sheetlight::scan::{CloudPoint, Raw, Stated, lines, read_foreign};
use std::path::Path;

/// Distance of columns and of rows of the plate of test shapes, mm.
const CELL: [f64; 2] = [0.215_850_83, 0.208_819_14];

struct Plate {
    width: usize,
    levels: Vec<u16>,
    light: Vec<u8>,
}

fn plate() -> Option<Plate> {
    let path = reference("import-map")?.join("height_maps/blobs/image.json");
    let json: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let bytes = |k: usize| {
        let text = json[k]["data"]["Data"]["Pixels"]["data"].as_str().unwrap();
        base64::engine::general_purpose::STANDARD.decode(text).unwrap()
    };
    let levels = bytes(0).chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
    Some(Plate { width: json[0]["data"]["Data"]["Width"].as_u64().unwrap() as usize, levels, light: bytes(1) })
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn star() -> String {
    let corner = |k: i32| {
        let (s, c) = (f64::from(k) * 36f64.to_radians()).sin_cos();
        let r = if k % 2 == 0 { 10.2 } else { 5.4 };
        format!("[{:.3}, {:.3}]", r * c, r * s)
    };
    let corners: Vec<String> = (0..10).map(corner).collect();
    let shape = format!("[[shape]]\nkind = 'polygon'\npoints = [{}]\n", corners.join(", "));
    let insertion = "[insertion]\napproach_mm = 30\nretract_mm = 60\ntolerance_mm = 0.25\ntolerance_deg = 0.5\n";
    format!("format = 1\nname = 'star'\ntitle = 'Star'\ncell_mm = 0.3\nalike_turns = 5\n{shape}{insertion}")
}

#[test]
fn a_part_is_found_on_the_map_of_another_sensor() {
    let Some(plate) = plate() else { return };
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let (w, h) = (plate.width as u32, (plate.levels.len() / plate.width) as u32);
    save_png(&Image::from_u16(w, h, 16, plate.levels.clone()), &at("plate.png")).unwrap();
    save_png(&Image::from_u8(w, h, plate.light.clone()), &at("light.png")).unwrap();
    let spacing = format!("{},{}", CELL[0], CELL[1]);
    let (plate_png, light_png, out) = (at("plate.png"), at("light.png"), at("plate"));
    let known = ["import-map", text(&plate_png), "--unit-mm", "0.02", "--spacing-mm", &spacing, "--out", text(&out)];
    let (_, said) = sheetlight_fails(&known);
    assert!(said.contains("--missing"), "{said}");
    let all = [&known[..], &["--missing", "0", "--light", text(&light_png), "--json"]].concat();
    let report: Value = serde_json::from_str(&sheetlight(&all)).unwrap();
    assert_eq!(report["points"].as_u64().unwrap() as usize, plate.levels.iter().filter(|v| **v != 0).count());
    assert!(report["frame"] == "map" && report["imported"]["sha256"].as_str().unwrap().len() == 64);
    std::fs::write(at("star.toml"), star()).unwrap();
    let (star_toml, found_json) = (at("star.toml"), at("star.json"));
    // Whether its gates are met is the recipe's affair: five points alike, no calibration known. Where it lies is not.
    let find = ["find", text(&out), "--recipe", text(&star_toml), "--out", text(&found_json), "--all"];
    std::process::Command::new(env!("CARGO_BIN_EXE_sheetlight")).args(find).output().unwrap();
    let found: Value = serde_json::from_str(&std::fs::read_to_string(&found_json).unwrap()).unwrap();
    assert_eq!(found["frame"], "map");
    let place: Vec<f64> = found["all"][0]["at_mm"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    // By eye: column 660.0, row 668.0; y runs against the rows.
    let off = (place[0] - 660.0 * CELL[0]).hypot(place[1] + 668.0 * CELL[1]);
    println!("star {off:.2} mm from where it is seen by eye; score {}", found["all"][0]["score"]);
    assert!(off < 1.0, "{place:?}");
    // The folder is imported again, and never laid over a scan of a rig.
    sheetlight(&all);
}

/// Noise of the drawn heights, mm.
const SIGMA_MM: f32 = 0.03;

/// Every file of the same points gives the same cloud.
#[test]
fn all_formats_hold_the_same_points() {
    let (w, h) = (40usize, 30usize);
    let noise = Normal::new(2.0f32, SIGMA_MM).unwrap();
    let mut rng = Pcg64::seed_from_u64(3);
    let mut z = |i: usize| if i % 7 == 3 { f32::NAN } else { noise.sample(&mut rng) };
    let xyz = |i: usize| [(i % w) as f32 * 0.5, -((i / w) as f32) * 0.25, z(i)];
    let all: Vec<[f32; 3]> = (0..w * h).map(xyz).collect();
    let seen: Vec<[f32; 3]> = all.iter().copied().filter(|p| p[2].is_finite()).collect();
    let big = |p: &[f32; 3]| p.iter().flat_map(|v| f64::from(*v).to_be_bytes()).collect::<Vec<_>>();
    let small = |p: &[f32; 3]| p.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>();
    let words = |p: &[f32; 3]| format!("{} {} {}\n", p[0], p[1], p[2]);
    let ply = |format: &str, kind: &str, n: usize| {
        let xyz = ["x", "y", "z"].map(|a| format!("property {kind} {a}\n")).concat();
        format!(
            "ply\nformat {format} 1.0\ncomment of another program\nelement vertex {n}\n{xyz}element face 0\n\
                 property list uchar int vertex_indices\nend_header\n"
        )
    };
    let pcd = |data: &str| {
        format!(
            "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {w}\nHEIGHT {h}\n\
                 VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {}\nDATA {data}\n",
            w * h
        )
    };
    let body = |head: String, bytes: Vec<u8>| [head.into_bytes(), bytes].concat();
    // Stored as they are: runs of at most 32 bytes behind their count; field by field.
    let columns: Vec<u8> = (0..3).flat_map(|k| all.iter().flat_map(move |p| p[k].to_le_bytes())).collect();
    let stored: Vec<u8> = columns.chunks(32).flat_map(|c| [&[c.len() as u8 - 1], c].concat()).collect();
    let lengths = [stored.len() as u32, columns.len() as u32].map(u32::to_le_bytes).concat();
    let files = [
        body(ply("ascii", "float", seen.len()), seen.iter().map(words).collect::<String>().into_bytes()),
        body(ply("binary_big_endian", "double", seen.len()), seen.iter().flat_map(big).collect()),
        body(ply("binary_little_endian", "float32", seen.len()), seen.iter().flat_map(small).collect()),
        body(pcd("ascii"), all.iter().map(words).collect::<String>().into_bytes()),
        body(pcd("binary"), all.iter().flat_map(small).collect()),
        body(pcd("binary_compressed"), [lengths, stored].concat()),
    ];
    let stated = Stated { unit_mm: Some(1.0), spacing_mm: Some([0.5, 0.25]), ..Stated::default() };
    let mut first: Option<Vec<[f32; 3]>> = None;
    for (k, file) in files.iter().enumerate() {
        let raw = read_foreign(file).unwrap_or_else(|e| panic!("file {k}: {e}"));
        let made = lines(&raw, None, &stated).unwrap();
        assert_eq!(made.size, [h, w], "file {k}");
        assert!((made.sigma_mm - f64::from(SIGMA_MM)).abs() < 0.15 * f64::from(SIGMA_MM), "{}", made.sigma_mm);
        let mut points: Vec<[f32; 3]> = made.points.iter().map(|p: &CloudPoint| p.position.to_array()).collect();
        points.sort_by(|a, b| b[1].total_cmp(&a[1]).then(a[0].total_cmp(&b[0])));
        assert_eq!(points, *first.get_or_insert(points.clone()), "file {k}");
        // Cut anywhere, it is refused or holds fewer points; nothing panics.
        for cut in [1, 10, file.len() / 2, file.len() - 1] {
            let _ = read_foreign(&file[..cut]).and_then(|raw| lines(&raw, None, &stated));
        }
    }
}

#[test]
fn nothing_is_guessed() {
    let picture = Raw::Picture {
        width: 40,
        height: 4,
        levels: (0..160).map(|i| f64::from(i % 5)).collect(),
        kind: Kind::Unsigned(8),
        says: Says::default(),
    };
    let scattered = Raw::Points { line: None, points: vec![[0.0, 0.0, 1.0]; 100], intensity: None, unit: None };
    let full =
        Stated { unit_mm: Some(0.1), spacing_mm: Some([1.0, 1.0]), missing: Some(Some(0.0)), ..Stated::default() };
    assert_eq!(lines(&picture, None, &full).unwrap().points.len(), 128);
    let refused = |raw: &Raw, stated: &Stated, word: &str| {
        let fault = lines(raw, None, stated).unwrap_err();
        assert!(fault.what.contains(word) && !fault.next.is_empty(), "{fault}");
    };
    refused(&picture, &Stated { unit_mm: None, ..full.clone() }, "unit");
    refused(&picture, &Stated { spacing_mm: None, ..full.clone() }, "distance");
    refused(&picture, &Stated { missing: None, ..full.clone() }, "not stated which level");
    refused(&scattered, &Stated { spacing_mm: None, ..full.clone() }, "distance of the points");
    refused(&picture, &Stated { unit_mm: Some(1e5), ..full.clone() }, "a point lies at");
    refused(&scattered, &Stated { spacing_mm: Some([1e-5, 1.0]), ..full.clone() }, "neighbours");
    let (kind, says) = (Kind::Unsigned(8), Says::default());
    let empty = Raw::Picture { width: 2, height: 2, levels: vec![0.0; 4], kind, says };
    refused(&empty, &full, "no point");
    assert!(lines(&picture, Some(&empty), &full).unwrap_err().what.contains("light"));
}
