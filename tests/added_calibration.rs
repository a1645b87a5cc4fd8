//! In: this source, a small calibration (tests/data/added_calibration). Out: whether a file and edits of five others
//! are all that a new calibration takes: a copy of the source with them is built, the command calibrates, and the HTTP
//! interface describes the order. SHEETLIGHT_LONG=1; the short form looks whether the places are there.
//! Frame and unit: none.

mod common;

use common::copied;
use std::path::Path;
use std::process::Command;

/// In these files, below this line, this one is put in. The last two are its button, and the
/// button's word in all languages.
const LINES: [[&str; 3]; 8] = [
    ["program/src/procedure/calibrate/mod.rs", "mod laser_plane;\n", "mod pinhole;\n"],
    [
        "program/src/procedure/calibrate/mod.rs",
        "pub use laser_plane::LaserPlaneOrder;\n",
        "pub use pinhole::PinholeOrder;\n",
    ],
    [
        "program/src/procedure/calibrate/mod.rs",
        "    Axis(AxisOrder),\n",
        "    /// A camera without distortion.\n    Pinhole(PinholeOrder),\n",
    ],
    [
        "program/src/cli/calibrate/mod.rs",
        "    ProfileHandEye(profile_hand_eye::Args),\n",
        "    /// Calibrate a camera without distortion\n    Pinhole(One<crate::procedure::calibrate::PinholeOrder>),\n",
    ],
    [
        "program/src/cli/calibrate/mod.rs",
        "        Command::Pointer(a) => one::run(a, console),\n",
        "        Command::Pinhole(a) => one::run(a, console),\n",
    ],
    ["program/src/web/message/mod.rs", "    crate::procedure::calibrate {\n", "        PinholeOrder,\n"],
    ["program/src/web/pages/pages/calibrate.js", "  camera: \"Camera\",\n", "  pinhole: \"Pinhole\",\n"],
    [
        "program/src/web/pages/base/texts.js",
        "  \"Piece\": [\"Stück\", \"区段\", \"区間\"],\n",
        "  \"Pinhole\": [\"Lochkamera\", \"针孔相机\", \"ピンホールカメラ\"],\n",
    ],
];

#[test]
fn a_calibration_is_a_file_and_edits_of_five() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files: Vec<&str> = LINES.iter().map(|[file, ..]| *file).collect();
    files.dedup();
    assert_eq!(files.len(), 5, "{files:?}");
    for [file, below, _] in LINES {
        let text = std::fs::read_to_string(here.join(file)).unwrap();
        assert_eq!(text.matches(below).count(), 1, "{file} has '{below}' once");
    }
    if std::env::var_os("SHEETLIGHT_LONG").is_none() {
        eprintln!("SHEETLIGHT_LONG=1 builds the source with a calibration more and calibrates: skipped");
        return;
    }
    let copy = tempfile::tempdir().unwrap();
    let members = ["gentl", "opcua", "program", "python", "registers", "ros2", "shader-twin"];
    for folder in ["src", "shaders", "tests", "benches", "examples", "data", "docs"].iter().chain(&members) {
        copied(&here.join(folder), &copy.path().join(folder));
    }
    for name in ["Cargo.toml", "Cargo.lock", "README.md"] {
        std::fs::copy(here.join(name), copy.path().join(name)).unwrap();
    }
    for [file, below, line] in LINES {
        let path = copy.path().join(file);
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(path, text.replace(below, &format!("{below}{line}"))).unwrap();
    }
    let to = "program/src/procedure/calibrate/pinhole.rs";
    std::fs::copy(here.join("tests/data/added_calibration/pinhole.rs"), copy.path().join(to)).unwrap();
    // Its own, and kept: the crates are built once.
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).join("added_calibration");
    let run = |program: &Path, args: &[&str]| {
        let mut command = Command::new(program);
        command.current_dir(copy.path()).args(args).env("CARGO_TARGET_DIR", &target).env("SHEETLIGHT_WRITE", "1");
        let run = command.output().unwrap();
        let said = String::from_utf8_lossy(&run.stdout).into_owned();
        assert!(run.status.success(), "{args:?}: {said}{}", String::from_utf8_lossy(&run.stderr));
        said
    };
    let of_the_program = ["--locked", "--offline", "--package", "sheetlight-program"];
    let cargo = |first: &[&str], last: &[&str]| run(Path::new(env!("CARGO")), &[first, &of_the_program, last].concat());
    cargo(&["build"], &[]);
    let program = target.join("debug/sheetlight");
    run(&program, &["simulate", "--set", "intrinsics", "--out", "made"]);
    let (recording, station) = ("made/intrinsics", "made/station");
    let said = run(&program, &["calibrate", "pinhole", recording, "--station", station, "--keep-badly-determined"]);
    // The lens has no terms, and each of them is stated as exactly 0.
    let without =
        |name: &str| said.lines().any(|line| line.split_whitespace().eq([name, "0.000000", "+-", "0.000000"]));
    assert!(without("k1") && without("p2") && !without("fx"), "{said}");
    cargo(&["test"], &["--test", "web", "messages_and_routes"]);
    let described = std::fs::read_to_string(copy.path().join("docs/openapi.json")).unwrap();
    assert!(described.contains("OrderCalibratePinhole"), "docs/openapi.json");
}
