//! In: what `cargo package` would publish. Out: a failure where the crate grows, where it lacks a file that its
//! sources read while they are built, and where its README leads to a file that is not in it.
//! Frame and unit: bytes.

use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};
use std::process::Command;

/// A registry takes 10 MB; half of our pictures would fill that.
const MOST_BYTES: u64 = 2_500_000;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn package(arguments: &[&str]) -> String {
    let out = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .current_dir(root())
        .args(["package", "--package", "sheetlight", "--locked", "--offline", "--allow-dirty", "--quiet"])
        .args(arguments)
        .output()
        .expect("cargo starts");
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    String::from_utf8(out.stdout).expect("names are UTF-8")
}

fn published() -> BTreeSet<String> {
    package(&["--list"]).lines().map(|l| l.replace('\\', "/")).collect()
}

fn read(name: &str) -> String {
    std::fs::read_to_string(root().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// `a/b/../c` without the way back.
fn plain(path: &Path) -> String {
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => assert!(out.pop(), "{} leaves the package", path.display()),
            part => out.push(part),
        }
    }
    out.to_string_lossy().replace('\\', "/")
}

/// What a source takes into the program while it is built.
fn taken_in(source: &str, text: &str) -> Vec<String> {
    let beside = Path::new(source).parent().expect("a file has a folder");
    ["include_str!(\"", "include_bytes!(\""]
        .iter()
        .flat_map(|call| text.match_indices(call).map(|(at, _)| &text[at + call.len()..]))
        .map(|rest| plain(&beside.join(&rest[..rest.find('"').expect("the name ends")])))
        .collect()
}

/// Files and folders of the tree that a page names; what the program makes there (`make demo`) is none of it.
fn named(page: &str) -> BTreeSet<String> {
    let ignored = read(".gitignore");
    let made = |w: &str| ignored.lines().filter_map(|l| l.strip_prefix('/')).any(|l| Path::new(w).starts_with(l));
    page.split(|c: char| !(c.is_ascii_alphanumeric() || "_-./".contains(c)))
        .map(|w| w.trim_end_matches(['.', '/']))
        .filter(|w| w.contains(['/', '.']) && !w.starts_with('/') && !made(w) && root().join(w).exists())
        .map(|w| plain(Path::new(w)))
        .filter(|w| !w.is_empty())
        .collect()
}

#[test]
fn what_a_source_takes_in_is_read() {
    let text = "const A: &str = include_str!(\"../b.wgsl\"); f(include_bytes!(\"c/d.bin\"))";
    assert_eq!(taken_in("src/x/a.rs", text), ["src/b.wgsl", "src/x/c/d.bin"]);
    let page = named("![x](docs/images/guide-found.png), ARCHITECTURE.md. See docs/robots/, 3/4 and nothing/here.md.");
    assert_eq!(page.iter().collect::<Vec<_>>(), ["ARCHITECTURE.md", "docs/images/guide-found.png", "docs/robots"]);
}

#[test]
fn the_crate_holds_what_builds_and_what_its_readme_leads_to() {
    let files = published();
    let lacks = |name: &str| !files.contains(name) && !files.iter().any(|f| f.starts_with(&format!("{name}/")));
    let mut faults = Vec::new();
    let sources: Vec<&String> = files.iter().filter(|f| f.ends_with(".rs")).collect();
    assert!(sources.len() > 400, "{} sources", sources.len());
    let (mut taken, mut shown) = (0, 0);
    for source in sources {
        for name in taken_in(source, &read(source)) {
            taken += 1;
            if lacks(&name) {
                faults.push(format!("{source} takes in {name}, which is not published"));
            }
        }
    }
    for name in named(&read("README.md")) {
        shown += 1;
        if lacks(&name) {
            faults.push(format!("README.md names {name}, which is not published"));
        }
    }
    assert!(taken > 40 && shown > 15, "{taken} files taken in, {shown} named by README.md");
    for file in files.iter().filter(|f| f.starts_with("tests/") || f.starts_with('.') && *f != ".cargo_vcs_info.json") {
        faults.push(format!("{file} is no use to who takes the crate"));
    }
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn the_crate_is_small() {
    let target = tempfile::tempdir().unwrap();
    let folder = target.path().to_str().unwrap();
    package(&["--no-verify", "--target-dir", folder]);
    let made: Vec<PathBuf> = std::fs::read_dir(target.path().join("package"))
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.is_file())
        .collect();
    let [made] = &made[..] else { panic!("{made:?}") };
    let bytes = made.metadata().unwrap().len();
    assert!((100_000..MOST_BYTES).contains(&bytes), "{bytes} bytes");
}

#[test]
fn the_manifest_says_what_a_registry_shows() {
    let manifest: toml::Value = toml::from_str(&read("Cargo.toml")).unwrap();
    for key in ["description", "license", "readme", "rust-version", "documentation", "keywords", "categories"] {
        assert!(manifest["package"].get(key).is_some(), "Cargo.toml has no {key}");
    }
    // A registry refuses more of either.
    for key in ["keywords", "categories"] {
        assert!((1..=5).contains(&manifest["package"][key].as_array().unwrap().len()), "{key}");
    }
}

/// The names of the crates that the library is built from, with these features.
fn built_from(features: &[&str]) -> BTreeSet<String> {
    let out = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .args(["tree", "--locked", "--offline", "--package", "sheetlight"])
        .args(features)
        .args(["--edges", "normal", "--prefix", "none", "--format", "{p}"])
        .current_dir(root())
        .output()
        .expect("cargo starts");
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let text = String::from_utf8(out.stdout).unwrap();
    let crates: BTreeSet<String> = text.lines().filter_map(|line| line.split(' ').next()).map(str::to_owned).collect();
    assert!(crates.contains("wgpu") && crates.contains("nalgebra"), "{text}");
    crates
}

/// What serves people, a terminal or a browser is no part of the engine that other programs build on.
#[test]
fn the_engine_needs_no_server_and_no_command_line_and_alone_no_pages() {
    let whole = built_from(&[]);
    for name in ["argon2", "axum", "clap", "indicatif", "mcap", "prost", "rumqttc", "rust-embed", "schemars", "ts-rs"] {
        assert!(!whole.contains(name), "{name}");
    }
    let alone = built_from(&["--no-default-features"]);
    for name in ["maud", "notify", "parquet", "tokio", "viva-genicam"] {
        assert!(whole.contains(name) && !alone.contains(name), "{name}");
    }
}
