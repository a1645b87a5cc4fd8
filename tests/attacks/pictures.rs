//! In: pictures and texts that are pipes, devices, bombs or far too long. Out: a fault before memory or time is spent.
//! Frame and unit: pixels, bytes.

use crate::table::{Case, Good, Want, Want::Says, case, check};
use sheetlight::raster::{Channel, Image, decode, load, load_sized, png};
use sheetlight::recording::{Meta, Recording};
use std::io::Write;
use std::path::{Path, PathBuf};

/// A PNG whose header says another size than its 4 x 4 pixels.
fn png_that_claims(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = png(&Image::from_u8(4, 4, vec![7; 16]));
    bytes[16..20].copy_from_slice(&width.to_be_bytes());
    bytes[20..24].copy_from_slice(&height.to_be_bytes());
    let sum = crc(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&sum.to_be_bytes());
    bytes
}

/// The checksum of PNG (ISO 3309).
fn crc(bytes: &[u8]) -> u32 {
    !bytes
        .iter()
        .fold(!0, |c: u32, &b| (0..8).fold(c ^ u32::from(b), |c, _| c >> 1 ^ if c & 1 == 1 { 0xedb8_8320 } else { 0 }))
}

fn sparse(path: &Path, bytes: u64) -> PathBuf {
    std::fs::File::create(path).and_then(|f| f.set_len(bytes)).expect("a sparse file");
    path.to_owned()
}

fn picture(name: &str, want: Want, path: PathBuf) -> Case {
    case(name, want, move || load_sized(&path, Channel::Luma, 8, [640, 480]))
}

#[test]
fn of_a_recording() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let write = |name: &str, bytes: &[u8]| {
        std::fs::File::create(at(name)).and_then(|mut f| f.write_all(bytes)).unwrap();
        at(name)
    };
    let flat = |w: u32, h: u32| png(&Image::from_u8(w, h, vec![9; (w * h) as usize]));
    let mut cases = vec![
        picture("a good picture", Good, write("good.png", &flat(640, 480))),
        picture("a sparse file of 8 GB", Says(&["8589934592 bytes", "at most"]), sparse(&at("sparse.png"), 8 << 30)),
        picture("a folder", Says(&["a folder"]), dir.path().to_owned()),
        picture("nothing", Says(&["cannot be read"]), at("none.png")),
        picture("no bytes", Says(&["0 bytes"]), write("empty.png", b"")),
        picture(
            "a bomb of 60000 x 60000",
            Says(&["is 60000x60000", "640x480"]),
            write("bomb.png", &png_that_claims(60_000, 60_000)),
        ),
        picture(
            "a PGM that claims 4 billion",
            Says(&["4294967295x4294967295"]),
            write("a.pgm", b"P5 4294967295 4294967295 255\n "),
        ),
    ];
    for (name, size) in [
        ("wider than 65,535 px", (70_000, 2)),
        ("of 65535 x 65535", (65_535, 65_535)),
        ("of 2^31 x 2^31", (1 << 31, 1 << 31)),
    ] {
        let bytes = png_that_claims(size.0, size.1);
        cases.push(case(format!("any picture {name}"), Says(&["at most 65535 a side"]), move || {
            decode(&bytes, Channel::Luma, 8)
        }));
    }
    #[cfg(unix)]
    {
        let fifo = at("fifo.png");
        assert!(std::process::Command::new("mkfifo").arg(&fifo).status().unwrap().success());
        cases.push(picture("a FIFO", Says(&["a pipe or a device"]), fifo.clone()));
        cases.push(picture("/dev/zero", Says(&["a pipe or a device"]), "/dev/zero".into()));
        cases.push(case("/dev/zero as any picture", Says(&["a pipe or a device"]), || {
            load(Path::new("/dev/zero"), Channel::Luma, 8)
        }));
        let (folder, text) = (at("recording"), dir.path().join("recording/meta.json"));
        std::fs::create_dir(&folder).unwrap();
        std::os::unix::fs::symlink("/dev/zero", &text).unwrap();
        cases.push(case("meta.json is /dev/zero", Says(&["a pipe or a device"]), move || Recording::open(&folder)));
    }
    let folder = at("long");
    std::fs::create_dir(&folder).unwrap();
    sparse(&folder.join("meta.json"), 8 << 30);
    cases.push(case("meta.json of 8 GB", Says(&["8589934592 bytes"]), move || Recording::open(&folder)));
    for (name, size) in [("70000 x 10", [70_000, 10]), ("65535 x 65535", [65_535, 65_535])] {
        let text = format!(
            r#"{{"format": 1, "set": "a", "units": "mm", "image": {{"width": {}, "height": {}, "bits": 8, "channels": 1,
            "response": "linear", "pixel_centre": "integer coordinates"}}, "frames": [{{"laser": "a.png"}}]}}"#,
            size[0], size[1]
        );
        cases.push(case(format!("a recording of {name}"), Says(&["too large", "limit 65535 a side"]), move || {
            Meta::parse(&text)
        }));
    }
    check(cases);
}
