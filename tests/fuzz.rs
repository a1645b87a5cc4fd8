//! In: valid files of every format that a person or another program writes, damaged at random. Out: each
//! parser answers with a value or an error that names something and says what to do next; none panics, hangs or eats
//! memory.
//! Frame and unit: none. As many mutations of each as SHEETLIGHT_LONG says (100,000 where it is 1), 300 without
//! it. What once failed is in tests/corpus and is read first.

#[path = "common/damage.rs"]
mod damage;

use damage::{scratch, sealed_anew, survives, text, through_file};
use proptest::prelude::*;
use sheetlight::find::dxf::{self, DxfOptions};
use sheetlight::find::{Drawing, ModelOptions, Recipe, Scene as FindScene, SearchOptions, Template, find};
use sheetlight::geometry::{Base, Flange, Plane, Rigid, Vec3};
use sheetlight::raster::{Channel, Image, decode, decode_in_part, float_tiff, png, read_float_tiff};
use sheetlight::recording::{BoardSpec, Markers, Meta, load_board_poses, load_poses};
use sheetlight::rig::Rig;
use sheetlight::scan::{
    Along, CloudPoint, CloudWriter, HeightMap, RawFormat, RawFrames, SHOTS_FILE, Shots, ShotsWriter, Stated, lines,
    read_cloud, read_foreign, write_cloud,
};
use sheetlight::simulate::{RigSpec, Scene, SceneSpec, Truth};
use sheetlight::station::{Checkpoint, Settings, Sigmas, Values, load_report};
use std::path::{Path, PathBuf};

const META: &str = r#"{"format": 1, "set": "a", "units": "mm", "beam": "line", "pose_file": "poses",
 "image": {"width": 640, "height": 480, "bits": 8, "channels": 1, "response": "linear",
  "pixel_centre": "integer coordinates"},
 "boards": [{"type": "chessboard", "inner_corners": [9, 6], "square_mm": 10.0, "border_mm": 7.0,
  "first_square": "black"}],
 "frames": [{"board": 0, "ambient": "a.png", "laser": "l.png", "pose": 0}]}"#;
const POSES_CSV: &str = "# convention: denso\nframe,x,y,z,rx,ry,rz\n0,1,2,3,4,5,6\n1,-1e2,2.5,3,180,0,90\n";
const POSES_JSON: &str = r#"{"units":"mm","layout":"row-major 4x4","transform":"base_T_flange",
 "poses":[{"frame":0,"matrix":[1,0,0,1,0,1,0,2,0,0,1,3,0,0,0,1]}]}"#;
const STATION: &str = include_str!("data/fuzz/station.toml");
const VALUES: &str = r#"{"intrinsics": {"fx": 611.6, "fy": 611.6, "cx": 315, "cy": 232, "width": 640, "height": 480,
 "distortion_k1_k2_p1_p2_k3": [0, 0, 0, 0, 0]}, "flange_T_camera": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
 "laser_plane_camera": {"normal": [0, 0.883, 0.469], "offset_mm": 72},
 "pointer_camera": {"origin": [1, 2, 3], "direction": [0, 0.6, 0.8]}}"#;
const DRAWING: &str = include_str!("data/fuzz/drawing.toml");
const DXF: &str = include_str!("data/fuzz/part.dxf");
const LISTING: &str = include_str!("data/fuzz/poses.ls");
const BOARDS: [&str; 5] = [
    r#"{"type": "chessboard", "inner_corners": [9, 6], "square_mm": 10.0, "border_mm": 7.0, "first_square": "black"}"#,
    r#"{"type": "charuco", "squares": [7, 5], "square_mm": 10.0, "marker_mm": 7.5, "dictionary": "DICT_4X4_50"}"#,
    r#"{"type": "circles", "dots": [7, 5], "pitch_mm": 10.0, "diameter_mm": 5.0, "asymmetric": true}"#,
    r#"{"type": "marker_grid", "markers": [5, 7], "marker_mm": 20.0, "gap_mm": 5.0,
     "dictionary": "DICT_APRILTAG_36h11", "first_id": 3}"#,
    r#"{"type": "marker_grid", "markers": [1, 1], "marker_mm": 80.0, "gap_mm": 0.0,
     "dictionary": "DICT_4X4_50", "first_id": 49}"#,
];
const BOARD_POSES: &str =
    "# transform: camera_T_board\n# convention: denso\nframe,x,y,z,rx,ry,rz\n0,1,2,300,4,5,6\n3,-10,2.5,280,180,0,90\n";

fn seeds(texts: &[&str]) -> Vec<Vec<u8>> {
    texts.iter().map(|t| t.as_bytes().to_vec()).collect()
}

fn shipped(folder: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join("data").join(folder);
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    files.iter().map(|f| std::fs::read(f).unwrap()).collect()
}

/// What every user of a drawing asks of it.
fn used(drawing: &Drawing) {
    let faces = drawing.faces();
    let [x0, y0, x1, y1] = drawing.bounds();
    faces.iter().for_each(|f| assert!(!f.material(x0 - 1.0, y0 - 1.0) && !f.material(x1 + 1.0, y1 + 1.0)));
    assert!(drawing.samples(0.5).iter().all(|s| s.x.is_finite() && s.y.is_finite()));
}

#[test]
fn meta() {
    survives("meta", seeds(&[META]), |b| Meta::parse(&text(b)).map(drop));
}

#[test]
fn stations() {
    survives("stations", seeds(&[STATION]), |b| Settings::parse(&text(b)).map(drop));
}

#[test]
fn poses() {
    survives("poses as CSV", seeds(&[POSES_CSV]), through_file("p.csv", |p| load_poses(p).map(drop)));
    survives("poses as JSON", seeds(&[POSES_JSON]), through_file("p.json", |p| load_poses(p).map(drop)));
}

#[test]
fn board_poses() {
    survives("board poses", seeds(&[BOARD_POSES]), through_file("b.csv", |p| load_board_poses(p).map(drop)));
    let json = POSES_JSON.replace("base_T_flange", "camera_T_board").replace("1,0,0,3", "1,3,0,3");
    let json = json.replace("0,0,1,3,", "0,0,1,300,");
    survives("board poses as JSON", seeds(&[&json]), through_file("b.json", |p| load_board_poses(p).map(drop)));
}

#[test]
fn rig_files() {
    survives("rig files", shipped("rigs"), |b| {
        let rig = RigSpec::parse(&text(b))?;
        // What every user of a rig asks of it.
        Recipe::parse(&rig.recipe(50))?;
        Scene::new(rig.scene()).map(drop)
    });
}

/// What a scan leaves for the next command, and an interrupted one for itself.
#[test]
fn scans() {
    let dir = scratch();
    let at = |name: &str| dir.path().join(name).to_str().unwrap().to_owned();
    let options = sheetlight::simulate::SimulateOptions { width: 64, height: 64, shots: 2, ..Default::default() };
    sheetlight::simulate::simulate(&dir.path().join("sim"), &options, &|_, _| {}).unwrap();
    let mut scan = std::process::Command::new(env!("CARGO_BIN_EXE_sheetlight"));
    scan.args([
        "scan",
        &at("sim/scan"),
        "--station",
        &at("sim/station"),
        "--out",
        &at("scan"),
        "--quiet",
        "--on",
        "cpu",
    ]);
    scan.output().unwrap();
    let seed = std::fs::read(at("scan/scan.json")).unwrap();
    let folder = scratch();
    survives("scan.json", vec![seed], move |b| {
        std::fs::write(folder.path().join("scan.json"), b).expect("a file");
        let report = load_report(folder.path())?;
        match report.has_points() {
            Err(e) if e.next.is_empty() => Err(e),
            _ => Ok(()),
        }
    });
    let folder = scratch();
    let sheet = Plane::new(Vec3::new(0.0, 0.6, 0.8), 72.5).unwrap();
    let mut list = ShotsWriter::create(folder.path(), "base", Along::U, "rig", Some(&sheet)).unwrap();
    (0..3).for_each(|shot| list.add(shot, Rigid::identity()));
    list.checkpoint().unwrap();
    let path = folder.path().join(SHOTS_FILE);
    let seed = std::fs::read(&path).unwrap();
    survives("shots", vec![seed], move |b| {
        std::fs::write(&path, b).expect("a file");
        Shots::load(folder.path(), "base", "rig")?;
        ShotsWriter::resume(folder.path(), 2, "base", "rig").map(drop)
    });
    let mut cloud = CloudWriter::create(&dir.path().join("cloud.ply")).unwrap();
    let mut state = Checkpoint::new("id".into());
    state.save(dir.path(), &mut cloud).unwrap();
    let seed = std::fs::read(at("progress.json")).unwrap();
    survives("checkpoints", vec![seed], move |b| {
        std::fs::write(dir.path().join("progress.json"), sealed_anew(b)).expect("a file");
        let Some(found) = Checkpoint::load(dir.path())? else { return Ok(()) };
        assert!(found.sigma.median_mm().is_none_or(f64::is_finite));
        std::hint::black_box(found.first_place());
        CloudWriter::resume(&dir.path().join("cloud.ply"), found.points).map(drop)
    });
}

#[test]
fn listings() {
    survives("FANUC listings", seeds(&[LISTING]), |b| {
        let read = sheetlight::robot::fanuc_tp::read::<Base, Flange>(&text(b))?;
        assert!(read.iter().all(|p| p.pose.rotation_vector().norm().is_finite()));
        Ok(())
    });
}

#[test]
fn calibrations() {
    let dir = scratch();
    std::fs::write(dir.path().join("values.json"), VALUES).unwrap();
    let values = Values::load(&dir.path().join("values.json")).unwrap();
    values.store(dir.path(), &dir.path().join("values.json"), true, &Sigmas::default()).unwrap();
    for kind in ["camera", "laser_plane", "pointer", "hand_eye"] {
        let station = scratch();
        let folder = station.path().join("calibration");
        std::fs::create_dir(&folder).unwrap();
        let seed = std::fs::read(dir.path().join(format!("calibration/{kind}.json"))).unwrap();
        let file = folder.join(format!("{kind}.json"));
        survives(kind, vec![seed], move |b| {
            std::fs::write(&file, sealed_anew(b)).expect("a file");
            Rig::load(station.path()).map(|rig| drop(rig.fingerprint()))
        });
    }
    survives(
        "values",
        seeds(&[VALUES]),
        through_file("values.json", |p| {
            let station = scratch();
            Values::load(p)?.store(station.path(), p, true, &Sigmas::default()).map(drop)
        }),
    );
}

/// Their values without the seal, which would keep every other mutation out.
#[test]
fn axes_and_counts() {
    use sheetlight::geometry::{Axis, AxisKind};
    use sheetlight::rig::{Calibration, Kind};
    for (axis, kind) in [(AxisKind::Linear, Kind::LinearAxis), (AxisKind::Turntable, Kind::Turntable)] {
        let motion = Some(axis);
        let options =
            sheetlight::simulate::SimulateOptions { width: 64, height: 64, shots: 2, motion, ..Default::default() };
        let dir = tempfile::tempdir().unwrap();
        let done = sheetlight::simulate::simulate(dir.path(), &options, &|_, _| {}).unwrap();
        let file = done.station.join("calibration").join(format!("{}.json", kind.name()));
        let mut record: serde_json::Value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
        record.as_object_mut().unwrap().remove("seal");
        let station = scratch();
        let file = station.path().join("calibration").join(format!("{}.json", kind.name()));
        std::fs::create_dir(station.path().join("calibration")).unwrap();
        survives(kind.name(), vec![record.to_string().into_bytes()], move |b| {
            let text = sealed_anew(b);
            std::fs::write(&file, &text).expect("a file");
            Rig::load(station.path())?;
            let mut record: serde_json::Value = serde_json::from_slice(&text).expect("the rig could be loaded");
            record.as_object_mut().expect("an object").remove("seal");
            let read: Calibration<Axis> = serde_json::from_value(record).expect("the rig could be loaded");
            assert!(read.value.axis_from_camera(7.0).translation.norm().is_finite());
            assert!(read.value.errors(7.0).iter().all(|e| e.v.norm().is_finite() && e.w.norm().is_finite()));
            Ok(())
        });
        let meta = std::fs::read(done.recordings[0].1.join("meta.json")).unwrap();
        let folder = tempfile::tempdir().unwrap();
        survives("meta of an axis", vec![meta], move |b| {
            std::fs::write(folder.path().join("meta.json"), b).expect("a file");
            sheetlight::recording::Recording::open(folder.path()).and_then(|r| r.counts()).map(drop)
        });
    }
    let folder = tempfile::tempdir().unwrap();
    let meta =
        META.replacen('{', r#"{"motion":{"kind":"linear","carries":"part","unit":"mm","counts_file":"c.csv"},"#, 1);
    std::fs::write(folder.path().join("meta.json"), meta).unwrap();
    let recording = sheetlight::recording::Recording::open(folder.path()).unwrap();
    survives("counts", seeds(&["frame,count\n0,-2.5e3\n"]), move |b| {
        std::fs::write(recording.folder.join("c.csv"), b).expect("a file");
        recording.counts().map(drop)
    });
    drop(folder);
}

#[test]
fn recipes_and_drawings() {
    survives("recipes", shipped("recipes"), |b| Recipe::parse(&text(b)).map(|r| used(&r.drawing())));
    survives("drawings", seeds(&[DRAWING]), |b| Drawing::parse(&text(b)).map(|d| used(&d)));
    survives("DXF", seeds(&[DXF]), |b| dxf::read(b, &DxfOptions::default()).map(|read| used(&read.drawing)));
}

#[test]
fn scenes_and_truth() {
    survives("scenes", shipped("scenes"), |b| SceneSpec::parse(&text(b)).and_then(Scene::new).map(drop));
    let options = sheetlight::simulate::SimulateOptions { width: 64, height: 64, shots: 2, ..Default::default() };
    let dir = scratch();
    let done = sheetlight::simulate::simulate(dir.path(), &options, &|_, _| {}).unwrap();
    let seed = std::fs::read(done.recordings[0].1.join("truth.json")).unwrap();
    survives("truth", vec![seed], through_file("truth.json", |p| Truth::load(p).map(drop)));
}

#[test]
fn boards() {
    survives(
        "boards",
        seeds(&BOARDS),
        through_file("board.json", |p| {
            let board = BoardSpec::load(p)?;
            assert!(board.features().len() < 1_000_000 && board.outline().iter().all(|v| v.is_finite()));
            let markers = Markers::of(&board)?;
            assert!(markers.is_none_or(|m| m.places().count() < 1_000_000));
            Scene::of_board(&board, 0.9, 0.1).map(drop)
        }),
    );
}

#[test]
fn clouds() {
    let dir = scratch();
    let path = dir.path().join("cloud.ply");
    let points: Vec<CloudPoint> =
        (0..5).map(|i| CloudPoint { position: [i as f32, 2.5, -1.0].into(), shot: 7, ..Default::default() }).collect();
    write_cloud(&path, &points).unwrap();
    let seed = std::fs::read(&path).unwrap();
    survives("PLY", vec![seed], through_file("cloud.ply", |p| read_cloud(p).map(drop)));
}

/// Height maps and clouds of other programs, and templates of `match`.
#[test]
fn foreign_maps() {
    let xyz = "property float x\nproperty float y\nproperty float z\n";
    let ply = |format: &str| {
        format!("ply\nformat {format} 1.0\nelement vertex 90\n{xyz}property uchar intensity\nend_header\n")
    };
    let lists = ply("binary_little_endian")
        .replace("property uchar intensity", "property list uchar uchar seen\nobj_info of another program");
    let pcd = |data: &str| {
        format!(
            "VERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\n\
             WIDTH 30\nHEIGHT 3\nPOINTS 90\nDATA {data}\n"
        )
    };
    let place = |i: usize| [(i % 30) as f32, (i / 30) as f32, 0.1 * (i % 4) as f32];
    let words: String = (0..90).map(|i| format!("{} {} {} 7\n", place(i)[0], place(i)[1], place(i)[2])).collect();
    let bytes = |tail: &[u8]| -> Vec<u8> {
        (0..90).flat_map(|i| [place(i).map(f32::to_le_bytes).concat(), tail.to_vec()].concat()).collect()
    };
    let with = |head: String, body: Vec<u8>| [head.into_bytes(), body].concat();
    let columns: Vec<u8> =
        (0..4).flat_map(|k| (0..90).flat_map(move |i| place(i).get(k).map_or([0; 4], |v| v.to_le_bytes()))).collect();
    let stored: Vec<u8> = columns.chunks(32).flat_map(|c| [&[c.len() as u8 - 1], c].concat()).collect();
    let lengths = [stored.len() as u32, columns.len() as u32].map(u32::to_le_bytes).concat();
    let seeds = vec![
        with(ply("ascii"), words.clone().into_bytes()),
        with(ply("binary_little_endian"), bytes(&[9])),
        with(lists, bytes(&[2, 8, 9])),
        with(pcd("ascii"), words.into_bytes()),
        with(pcd("binary"), bytes(&[1, 2, 3, 4])),
        with(pcd("binary_compressed"), [lengths, stored].concat()),
        float_tiff(30, 3, &(0..90).map(|i| place(i)[2]).collect::<Vec<_>>(), "mm"),
    ];
    let stated = Stated { unit_mm: Some(1.0), spacing_mm: Some([1.0, 1.0]), ..Stated::default() };
    survives("foreign maps", seeds, move |b| {
        let made = lines(&read_foreign(b)?, None, &stated)?;
        assert!(made.points.iter().all(|p| p.position.is_finite()) && made.sigma_mm > 0.0);
        Ok(())
    });
    let pixels =
        (0..48 * 40).map(|i| if (14..34).contains(&(i % 48)) && (10..30).contains(&(i / 48)) { 200 } else { 20 });
    let image = Image::from_u8(48, 40, pixels.collect());
    let options = ModelOptions { max_points: 40, ..ModelOptions::default() };
    let taught = Template::teach("box", &image, None, ("a.png".into(), "0".into()), &options).unwrap();
    let seed = serde_json::to_vec(&taught).unwrap();
    survives("templates", vec![seed], move |b| {
        let taught = Template::parse(&text(b))?;
        let least = SearchOptions { min_score: 0.9, ..SearchOptions::default() };
        find(&FindScene::from_image(&image), &taught.model, &least).map(drop)
    });
}

#[test]
fn pictures() {
    let grey = png(&Image::from_u8(16, 16, (0..=255).collect()));
    let deep = png(&Image::from_u16(8, 8, 12, (0..64).map(|i| i * 60).collect()));
    survives("PNG", vec![grey], |b| decode(b, Channel::Luma, 8).map(drop));
    survives("PNG of 12 bits", vec![deep], |b| decode(b, Channel::Luma, 12).map(drop));
    survives("PGM", seeds(&["P5\n# a comment\n4 2\n255\n12345678", "P5 2 2 255\nabcd"]), |b| {
        decode(b, Channel::Luma, 8).map(drop)
    });
    for (name, format) in [("JPEG", image::ImageFormat::Jpeg), ("BMP", image::ImageFormat::Bmp)] {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let picture = image::GrayImage::from_fn(16, 16, |x, y| image::Luma([(x * y) as u8]));
        picture.write_to(&mut bytes, format).unwrap();
        survives(name, vec![bytes.into_inner()], |b| decode(b, Channel::Luma, 8).map(drop));
    }
    let tiff = float_tiff(4, 3, &[1.5; 12], "mm");
    survives("TIFF", vec![tiff.clone()], |b| read_float_tiff(b).map(drop));
    // Files that say something about their own samples, as heights and as light.
    let stated = |names: &[&str]| -> Vec<Vec<u8>> {
        let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join("tests/data/statements");
        names.iter().map(|name| std::fs::read(folder.join(name)).expect("a file")).collect()
    };
    let seeds_of = [
        (
            "TIFF that says something",
            stated(&[
                "02-float-tiff-white-is-zero/white16.tif",
                "07-gdal-nodata/n.tif",
                "13-tiff-of-several-pages/thumb.tif",
                "19-tiff-kinds/big.tif",
                "19-tiff-kinds/i16.tif",
                "19-tiff-kinds/f16.tif",
            ]),
        ),
        (
            "PNG that says something",
            stated(&[
                "09-template-with-alpha/template.png",
                "10-four-bit-png/g4.png",
                "11-colour-picture-as-heights/jet.png",
            ]),
        ),
        ("PCD of many fields", stated(&["20-pcd-64-bit-field/u8.pcd"])),
    ];
    for (name, seeds) in seeds_of {
        survives(name, seeds, |b| {
            let shown = decode_in_part(b, Channel::Luma, 8);
            let heights = read_foreign(b).map(drop);
            match (shown, heights) {
                (Err(e), _) | (_, Err(e)) if e.next.is_empty() => Err(e),
                _ => Ok(()),
            }
        });
    }
    survives("TIFF as a picture", vec![tiff], |b| match decode(b, Channel::Luma, 8) {
        // Floats are no grey levels.
        Err(e) if e.next.is_empty() => Err(e),
        _ => Ok(()),
    });
}

#[test]
fn height_maps() {
    let dir = scratch();
    HeightMap::empty(6, 5, 0.5, sheetlight::geometry::Rigid::identity()).save(dir.path()).unwrap();
    for name in ["height.json", "height.tif", "count.png"] {
        let file = dir.path().join(name);
        let seed = std::fs::read(&file).unwrap();
        let (folder, path, whole) = (dir.path().to_owned(), file.clone(), seed.clone());
        survives(name, vec![seed], move |b| {
            std::fs::write(&path, b).expect("a file");
            HeightMap::load(&folder).map(drop)
        });
        std::fs::write(&file, whole).unwrap();
    }
}

#[test]
fn profiles() {
    use sheetlight::recording::profiles::{from_csv, from_yaml};
    let csv = "profile,x,z\n0,1.5,2.5\n0,2.5,3.5\n1,1,2\n1,2,3\n";
    let yaml = "%YAML:1.0\na: !!opencv-matrix\n   rows: 2\n   cols: 3\n   dt: f\n   data: [ 1., 2., 3., 4., 5., 6. ]\n";
    survives("profiles as CSV", seeds(&[csv]), |b| from_csv(&text(b), "a").map(drop));
    survives("profiles as YAML", seeds(&[yaml]), |b| from_yaml(&text(b), "a").map(drop));
    let brackets = ["[[[1, 2], [2, 3], [3, 5]], [[1, 2], [2, 4]]]", "a: [1, 2, 2, 3, 3, 4]\nb: [4, 5, 6, 7, 8, 9]\n"];
    survives(
        "profiles in brackets",
        seeds(&brackets),
        through_file("p.json", |p| sheetlight::recording::profiles::load(p).map(drop)),
    );
}

#[test]
fn raw_frames() {
    survives("raw frames", seeds(&["0123456789abcdef0123456789abcdef"]), |b| {
        let mut frames = RawFrames::new("4x2:gray16le".parse::<RawFormat>().expect("a format"), b);
        // Bytes that end within a frame are named; the undamaged ones do not.
        while frames.read()?.is_some() {}
        Ok(())
    });
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn raw_format(text in "[0-9a-z:x]{0,24}") {
        let _ = text.parse::<RawFormat>();
    }
}
