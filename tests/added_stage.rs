//! In: this source, a small stage in two files (tests/data/added_stage). Out: whether two files and a line are all
//! that a new stage takes (ARCHITECTURE.md, One stage): a copy of the source with them is built, and the tests of all
//! stages run over it. SHEETLIGHT_LONG=1; the short form looks whether the places are there. Frame and unit: pixels.

mod common;

use common::copied;
use std::path::Path;
use std::process::Command;

/// In these files, below this line, this one is put in: the room's, the chain's, and the plain definition's, which says
/// what the stage does to the mask.
const LINES: [[&str; 3]; 3] = [
    ["src/stages/stripe/mod.rs", "pub mod bound;\n", "pub mod border;\n"],
    [
        "src/stages/chain/table.rs",
        "const BACK: &[(When, Step)] = &[\n",
        "    (always, crate::stages::stripe::border::STEP),\n",
    ],
    [
        "tests/stages.rs",
        "            let thinned = thin::twin(&lit, scene.thinning);\n",
        "            let thinned = stages::stripe::border::plain(&thinned);\n",
    ],
];
/// Of tests/data/added_stage, and where they go.
const FILES: [[&str; 2]; 2] = [["border.wgsl", "shaders"], ["border.rs", "src/stages/stripe"]];

#[test]
fn a_stage_is_two_files_and_a_line() {
    let (here, dir) = (Path::new(env!("CARGO_MANIFEST_DIR")), tempfile::tempdir().unwrap());
    let long = std::env::var_os("SHEETLIGHT_LONG").is_some();
    if long {
        ["src", "shaders", "tests", "benches", "examples", "data", "docs"]
            .iter()
            .for_each(|d| copied(&here.join(d), &dir.path().join(d)));
        for name in ["Cargo.toml", "Cargo.lock", "README.md"] {
            std::fs::copy(here.join(name), dir.path().join(name)).unwrap();
        }
    }
    for [file, below, line] in LINES {
        let text = std::fs::read_to_string(here.join(file)).unwrap();
        assert_eq!(text.matches(below).count(), 1, "{file} has '{below}' once");
        if long {
            std::fs::write(dir.path().join(file), text.replace(below, &format!("{below}{line}"))).unwrap();
        }
    }
    if !long {
        eprintln!("SHEETLIGHT_LONG=1 builds the source with a stage more and runs the tests of all stages: skipped");
        return;
    }
    for [file, room] in FILES {
        std::fs::copy(here.join("tests/data/added_stage").join(file), dir.path().join(room).join(file)).unwrap();
    }
    let run = Command::new(env!("CARGO"))
        .current_dir(dir.path())
        .args(["test", "--locked", "--offline", "--test", "stages", "--test", "shader_contracts"])
        .args(["--", "--nocapture"])
        // Its own: the program of that name in the other one is what other tests run. Kept: the crates are built once.
        .env("CARGO_TARGET_DIR", Path::new(env!("CARGO_TARGET_TMPDIR")).join("added_stage"))
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&run.stdout);
    assert!(run.status.success(), "{said}{}", String::from_utf8_lossy(&run.stderr));
    assert!(said.contains("the_chain_of_twins_is_the_plain_definition ... ok"), "{said}");
    // Without Vulkan the stages are not compared, and their test says so.
    if common::device().is_some() {
        println!("{}", said.lines().find(|l| l.starts_with("border ")).expect("a line of the new stage"));
    }
}
