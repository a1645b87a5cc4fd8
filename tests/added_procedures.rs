//! In: this source, a small calibration (tests/data/added_calibration), a small order of the screen
//! (tests/data/added_order). Out: whether a file and edits of five others are all that either takes: a copy of the
//! source with both is built, the command calibrates, the screen's server executes the order, and the HTTP interface
//! describes both. SHEETLIGHT_LONG=1; the short form looks whether the places are there.
//! Frame and unit: none.

mod common;

use common::copied;
use std::path::Path;
use std::process::Command;

/// In this file, below this line, this one is put in.
type Edit = [&'static str; 3];

/// The last two are its button, and the button's word in all languages.
const CALIBRATION: [Edit; 8] = [
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

const ORDER: [Edit; 9] = [
    ["program/src/procedure/mod.rs", "pub mod calibrate;\n", "mod extent;\n"],
    ["program/src/procedure/mod.rs", "pub use at::{At, Names, Remark};\n", "pub use extent::{Extent, ExtentOrder};\n"],
    [
        "program/src/web/message/order.rs",
        "use crate::procedure::calibrate::{AutoOrder, CalibrateOrder, JointOrder};\n",
        "use crate::procedure::{Extent, ExtentOrder};\n",
    ],
    [
        "program/src/web/message/order.rs",
        "    Scan(ScanOrder),\n",
        "    /// Reads a scan's extent.\n    Extent(ExtentOrder),\n",
    ],
    [
        "program/src/web/message/order.rs",
        "    Scan(Box<ScanFigures>),\n",
        "    /// A scan's extent.\n    Extent(Extent),\n",
    ],
    [
        "program/src/web/work/procedures.rs",
        "        Order::Scan(ask) => scan::scan(this, ask),\n",
        "        Order::Extent(ask) => Ok(Outcome::Extent(this.remarked(|at| ask.extent(at))?.0)),\n",
    ],
    [
        "program/src/web/pages/pages/part.js",
        "    run({ procedure: \"find\", scans: [scan.id], recipe: name }, (j) => shown(j, j.outcome));\n",
        "  const extent = () => run({ procedure: \"extent\", scan: scan.id }, (j) => console.log(j.outcome));\n",
    ],
    [
        "program/src/web/pages/pages/part.js",
        "      h(\"button\", { class: \"main\", id: \"find\", onclick: find }, t(\"Find\")),\n",
        "      h(\"button\", { id: \"extent\", onclick: extent }, t(\"Extent\")),\n",
    ],
    [
        "program/src/web/pages/base/texts.js",
        "  \"Exposure\": [\"Belichtung\", \"曝光\", \"露光\"],\n",
        "  \"Extent\": [\"Ausdehnung\", \"范围\", \"範囲\"],\n",
    ],
];

#[test]
fn a_calibration_or_an_order_is_a_file_and_edits_of_five() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    for edits in [&CALIBRATION[..], &ORDER] {
        let mut files: Vec<&str> = edits.iter().map(|[file, ..]| *file).collect();
        files.dedup();
        assert_eq!(files.len(), 5, "{files:?}");
        for [file, below, _] in edits {
            let text = std::fs::read_to_string(here.join(file)).unwrap();
            assert_eq!(text.matches(below).count(), 1, "{file} has '{below}' once");
        }
    }
    if std::env::var_os("SHEETLIGHT_LONG").is_none() {
        eprintln!("SHEETLIGHT_LONG=1 builds the source with a calibration and an order more, and runs them: skipped");
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
    for [file, below, line] in CALIBRATION.iter().chain(&ORDER) {
        let path = copy.path().join(file);
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(path, text.replace(below, &format!("{below}{line}"))).unwrap();
    }
    let procedures = copy.path().join("program/src/procedure");
    let added = |from: &str, to: &str| std::fs::copy(here.join("tests/data").join(from), procedures.join(to)).unwrap();
    added("added_calibration/pinhole.rs", "calibrate/pinhole.rs");
    added("added_order/extent.rs", "extent.rs");
    // Its own, and kept: the crates are built once.
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).join("added_procedures");
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
    let tests = copy.path().join("tests/web");
    let [program, tests] = [&program, &tests].map(|path| path.to_str().unwrap());
    run(Path::new("python3"), &["tests/data/added_order/order.py", program, "served", tests]);
    cargo(&["test"], &["--test", "web", "messages_and_routes"]);
    for (document, words) in
        [("openapi.json", "OrderCalibratePinhole"), ("openapi.json", "OrderExtent"), ("messages.d.ts", "ExtentOrder")]
    {
        let described = std::fs::read_to_string(copy.path().join("docs").join(document)).unwrap();
        assert!(described.contains(words), "docs/{document}: {words}");
    }
}
