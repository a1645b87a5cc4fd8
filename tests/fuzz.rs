//! In: valid files of every format that a person or another program writes, damaged at random. Out: each
//! parser answers with a value or an error that names something; none panics, hangs or eats memory.
//! Frame and unit: none.

use proptest::prelude::*;
use sheetlight::fault::Fault;
use sheetlight::raster::{Channel, Image, decode, save_png};
use sheetlight::recording::Meta;
use sheetlight::station::Settings;

const META: &str = r#"{"format": 1, "set": "a", "units": "mm", "beam": "line", "pose_file": "poses",
 "image": {"width": 640, "height": 480, "bits": 8, "channels": 1, "response": "linear", "pixel_centre": "integer coordinates"},
 "boards": [{"type": "chessboard", "inner_corners": [9, 6], "square_mm": 10.0, "border_mm": 7.0, "first_square": "black"}],
 "frames": [{"board": 0, "ambient": "a.png", "laser": "l.png", "pose": 0}]}"#;
const POSES_CSV: &str = "# convention: denso\nframe,x,y,z,rx,ry,rz\n0,1,2,3,4,5,6\n1,-1e2,2.5,3,180,0,90\n";
const POSES_JSON: &str = r#"{"units":"mm","layout":"row-major 4x4","transform":"base_T_flange","poses":[{"frame":0,"matrix":[1,0,0,1,0,1,0,2,0,0,1,3,0,0,0,1]}]}"#;
const STATION: &str = "name = 'cell'\nrobot = 'denso'\n[working_volume]\nnear_mm = 60.0\nfar_mm = 320.0\n[extraction.threshold]\nsize = 31\noffset = 5\n";

/// Cuts, doubles, replaces and inserts bytes.
fn damage(text: &str, edits: &[(u8, u16, u8)]) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    for &(kind, at, byte) in edits {
        let at = at as usize % (bytes.len() + 1);
        match kind % 5 {
            0 => bytes.truncate(at),
            1 if at < bytes.len() => bytes[at] = byte,
            2 => bytes.insert(at, byte),
            3 => {
                let tail = bytes[at..].to_vec();
                bytes.extend(tail);
            }
            // Digits make numbers huge, which is where limits are forgotten.
            _ => bytes.splice(at..at, *b"99999999").for_each(drop),
        }
    }
    bytes
}

fn says_something<T>(answer: Result<T, Fault>) {
    if let Err(fault) = answer {
        assert!(!fault.what.is_empty());
    }
}

fn edits() -> impl Strategy<Value = Vec<(u8, u16, u8)>> {
    proptest::collection::vec((any::<u8>(), any::<u16>(), any::<u8>()), 1..6)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn meta(e in edits()) {
        says_something(Meta::parse(&String::from_utf8_lossy(&damage(META, &e))));
    }

    #[test]
    fn station(e in edits()) {
        says_something(Settings::parse(&String::from_utf8_lossy(&damage(STATION, &e))));
    }

    #[test]
    fn poses(e in edits(), json in any::<bool>()) {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(if json { "p.json" } else { "p.csv" });
        std::fs::write(&path, damage(if json { POSES_JSON } else { POSES_CSV }, &e)).unwrap();
        says_something(sheetlight::recording::load_poses(&path));
    }

    #[test]
    fn raw_format(text in "[0-9a-z:x]{0,24}") {
        let _ = text.parse::<sheetlight::scan::RawFormat>();
    }

    #[test]
    fn pictures(cut in 0usize..400, at in 0usize..400, byte in any::<u8>()) {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        save_png(&Image::from_u8(16, 16, (0..=255).collect()), &path).unwrap();
        let mut bytes = std::fs::read(&path).unwrap();
        let n = bytes.len();
        bytes[at % n] = byte;
        bytes.truncate(n - cut % n);
        says_something(decode(&bytes, Channel::Luma, 8));
    }
}

#[test]
fn the_undamaged_files_are_good() {
    assert!(Meta::parse(META).is_ok());
    assert!(Settings::parse(STATION).is_ok());
    let dir = tempfile::tempdir().unwrap();
    for (name, text) in [("p.csv", POSES_CSV), ("p.json", POSES_JSON)] {
        let path = dir.path().join(name);
        std::fs::write(&path, text).unwrap();
        assert!(sheetlight::recording::load_poses(&path).is_ok(), "{name}");
    }
}
