//! The example project passes, and prints what README.md shows of it.

mod common;
#[path = "../examples/prefix_sum.rs"]
mod prefix_sum;

#[test]
fn the_example_passes_and_readme_shows_what_it_prints() {
    // The example's own way in; cargo builds it, this test runs what it calls.
    let _ = prefix_sum::main;
    let Some(device) = common::device() else { return };
    let folder = std::env::temp_dir().join(format!("shader-twin-example-{}", std::process::id()));
    let report = prefix_sum::run(&device, &folder).unwrap();
    assert!(report.passed(), "{report}");
    assert!(std::fs::read_to_string(folder.join("report.md")).unwrap().contains("Verdict: **passed**"));
    std::fs::remove_dir_all(folder).unwrap();
    let readme = include_str!("../README.md");
    // Times and adapters differ.
    let printed = report.to_string();
    let counts = printed.lines().last().unwrap();
    assert!(readme.lines().any(|l| l == counts), "README.md does not show: {counts}");
}
