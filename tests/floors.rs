//! In: the `use` lines and paths of src/ and program/src/. Out: a failure for every import from a higher floor, and
//! for every outside crate named away from its home (ARCHITECTURE.md).
//! Frame and unit: none.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What each room of the library may import, `fault` and `files` excepted, which everybody may. The program stands on
/// the library: cargo refuses the other way round.
const LIBRARY: &[(&str, &[&str])] = &[
    ("fault", &[]),
    ("bcap", &[]),
    ("files", &[]),
    ("geometry", &[]),
    ("raster", &[]),
    ("solve", &[]),
    ("gpu", &[]),
    ("camera", &["geometry"]),
    ("robot", &["geometry"]),
    ("recording", &["geometry", "raster", "camera", "robot"]),
    ("arm", &["bcap", "geometry", "robot", "recording"]),
    ("rig", &["geometry", "camera"]),
    ("simulate", &["geometry", "raster", "solve", "camera", "robot", "recording", "rig"]),
    ("calibrate", &["geometry", "raster", "solve", "camera", "robot", "recording", "rig"]),
    ("capture", &["geometry", "raster", "solve", "camera", "robot", "recording", "arm", "rig", "simulate"]),
    ("stages", &["geometry", "raster", "camera", "gpu"]),
    ("scan", &["geometry", "raster", "solve", "gpu", "camera", "robot", "recording", "rig", "capture", "stages"]),
    ("find", &["geometry", "raster", "solve", "gpu", "camera", "robot", "recording", "rig", "stages", "scan"]),
    (
        "station",
        &[
            "geometry",
            "raster",
            "solve",
            "gpu",
            "camera",
            "robot",
            "recording",
            "arm",
            "rig",
            "simulate",
            "calibrate",
            "capture",
            "stages",
            "scan",
            "find",
        ],
    ),
];

/// What each room of the program may import of the program.
const PROGRAM: &[(&str, &[&str])] = &[
    ("bench", &[]),
    ("cell", &[]),
    ("ros", &[]),
    ("procedure", &[]),
    ("web", &["bench", "cell", "procedure"]),
    ("cli", &["bench", "cell", "ros", "procedure", "web"]),
];

/// Outside crates with one home, or a few; named anywhere else they would spread.
const HOMES: &[(&str, &str)] = &[
    ("argon2", "web"),
    ("ash", "gpu"),
    ("axum", "web"),
    ("calib_targets_charuco", "calibrate"),
    ("calib_targets_chessboard", "calibrate"),
    ("calib_targets_core", "calibrate"),
    ("chess_corners", "calibrate"),
    ("clap", "cli procedure"),
    ("crc32fast", "station"),
    ("futures_util", "web"),
    ("image", "raster"),
    ("indicatif", "cli"),
    ("mcap", "ros"),
    ("mimalloc", "main"),
    ("multiversion", "stages"),
    ("notify", "capture"),
    ("parquet", "station"),
    ("png", "raster"),
    ("zune_jpeg", "raster"),
    ("pollster", "gpu"),
    ("prost", "web"),
    ("rpassword", "cli"),
    ("rs_opw_kinematics", "cell"),
    ("rumqttc", "web"),
    ("rust_embed", "web"),
    ("saphyr_parser", "files"),
    ("schemars", "web procedure"),
    ("signal_hook", "cli"),
    ("tiff", "raster"),
    ("tokio", "web"),
    ("tokio_rustls", "web"),
    ("toml_edit", "station"),
    ("toml_parser", "station"),
    ("ts_rs", "web procedure"),
    ("viva_genicam", "capture"),
    ("wgpu", "gpu"),
];

/// Outside crates that any floor may use: numbers, files, pages, names of values, threads, chance.
const COMMON: &[&str] = &[
    "base64",
    "bytemuck",
    "calib_targets_aruco",
    "csv",
    "glam",
    "jiff",
    "libm",
    "maud",
    "nalgebra",
    "rand",
    "rand_distr",
    "rand_pcg",
    "rayon",
    "serde",
    "serde_json",
    "sha2",
    "strum",
    "tempfile",
    "toml",
];

fn sources(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()) {
        if entry.is_dir() {
            sources(&entry, out);
        } else if entry.extension().is_some_and(|e| e == "rs") {
            out.push(entry);
        }
    }
}

/// The modules named by `crate::x` in one source, comments left out.
fn imports(text: &str) -> Vec<String> {
    let code = text.lines().map(|l| l.split("//").next().unwrap_or("")).collect::<Vec<_>>().join("\n");
    let mut found = Vec::new();
    for (at, _) in code.match_indices("crate::") {
        let rest = &code[at + 7..];
        match rest.strip_prefix('{') {
            Some(group) => {
                let mut depth = 0;
                for part in group.split_inclusive([',', '{', '}']) {
                    let name: String =
                        part.trim_start().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                    if depth == 0 && !name.is_empty() {
                        found.push(name);
                    }
                    depth += i32::from(part.ends_with('{')) - i32::from(part.ends_with('}'));
                    if depth < 0 {
                        break;
                    }
                }
            }
            None => found.push(rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()),
        }
    }
    found
}

fn home_of(path: &Path, src: &Path) -> String {
    let first = path.strip_prefix(src).unwrap().components().next().unwrap();
    first.as_os_str().to_string_lossy().trim_end_matches(".rs").to_owned()
}

/// Folders of sources from the root, each with its floors.
const PACKAGES: [(&str, &[(&str, &[&str])]); 2] = [("src", LIBRARY), ("program/src", PROGRAM)];

#[test]
fn every_module_imports_only_from_lower_floors() {
    let faults: Vec<String> = PACKAGES.iter().flat_map(|(folder, floors)| from_above(folder, floors)).collect();
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

/// Imports against the floors, and outside crates away from their homes.
fn from_above(folder: &str, floors: &[(&str, &[&str])]) -> Vec<String> {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let may: BTreeMap<&str, &[&str]> = floors.iter().copied().collect();
    let mut files = Vec::new();
    sources(&src, &mut files);
    assert!(files.len() > 100, "{folder}: {} files", files.len());
    let mut faults = Vec::new();
    for path in files {
        let (module, text) = (home_of(&path, &src), std::fs::read_to_string(&path).unwrap());
        if module == "lib" || module == "main" {
            continue;
        }
        let allowed = may
            .get(module.as_str())
            .unwrap_or_else(|| panic!("{module} stands on no floor: add it to ARCHITECTURE.md and here"));
        for import in imports(&text) {
            if import != "fault" && import != "files" && import != module && !allowed.contains(&import.as_str()) {
                faults.push(format!("{}: {module} imports {import}", path.display()));
            }
        }
        for (vendor, homes) in HOMES {
            let vendor = format!("{vendor}::");
            let named = text.lines().any(|l| {
                let code = l.split("//").next().unwrap_or("");
                code.match_indices(&vendor)
                    .any(|(at, _)| !code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == ':'))
            });
            if named && homes.split(' ').all(|home| home != module) {
                faults.push(format!("{}: {vendor} belongs to {homes}", path.display()));
            }
        }
    }
    faults
}

#[test]
fn imports_are_read_in_every_form() {
    assert_eq!(imports("use crate::geometry::{Rigid, Vec3};"), ["geometry"]);
    assert_eq!(imports("use crate::{camera::Intrinsics, rig::{Rig, Verdict}, scan};"), ["camera", "rig", "scan"]);
    assert_eq!(imports("fn f() { crate::station::run() } // crate::cli"), ["station"]);
}

/// What Cargo.toml depends on, on any system, as sources name it.
fn dependencies(manifest: &str) -> Vec<String> {
    let mut inside = false;
    let mut found = Vec::new();
    for line in manifest.lines().map(str::trim) {
        if line.starts_with('[') {
            inside = line == "[dependencies]" || line.starts_with("[target.") && line.ends_with(".dependencies]");
        } else if inside && !line.starts_with('#') {
            found.extend(line.split_once('=').map(|(name, _)| name.trim().replace('-', "_")));
        }
    }
    found.retain(|name| name != "sheetlight");
    found.sort();
    found.dedup();
    found
}

#[test]
fn every_outside_crate_has_a_home_or_is_for_all() {
    let manifest = |name: &str| std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(name)).unwrap();
    let used = dependencies(&(manifest("Cargo.toml") + &manifest("program/Cargo.toml")));
    let mut known: Vec<String> = HOMES.iter().map(|h| h.0).chain(COMMON.iter().copied()).map(str::to_owned).collect();
    known.sort();
    assert_eq!(used, known, "what the two packages depend on, and what HOMES and COMMON name");
}

/// A test that needs an adapter gets it from the one place of its kind, which skips it aloud, and fails it where an
/// adapter is required.
#[test]
fn tests_get_their_adapter_where_the_skip_is() {
    const HOMES: [&str; 2] = ["tests/common/mod.rs", "src/gpu/open.rs"];
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let of_tests = |path: &str, text: &str| {
        let from = if path.starts_with("tests/") { 0 } else { text.find("#[cfg(test)]").unwrap_or(text.len()) };
        text[from..].to_owned()
    };
    let mut files = Vec::new();
    ["src", "program/src", "tests"].iter().for_each(|folder| sources(&root.join(folder), &mut files));
    let mut own = Vec::new();
    for file in files {
        let path = file.strip_prefix(root).unwrap().to_string_lossy().into_owned();
        let text = of_tests(&path, &std::fs::read_to_string(&file).unwrap());
        // Split, so that this line is not one of them.
        let [open, required] = [["Device::", "open()"], ["SHEETLIGHT_", "REQUIRE_GPU"]].map(|w| w.concat());
        let skips = |l: &&str| l.contains(&required) || (l.contains(&open) && !l.contains(&format!("{open}.unwrap()")));
        if !HOMES.contains(&path.as_str()) {
            own.extend(text.lines().filter(skips).map(|l| format!("{path}: {}", l.trim())));
        }
    }
    assert!(own.is_empty(), "use common::device or Device::for_tests:\n{}", own.join("\n"));
}
