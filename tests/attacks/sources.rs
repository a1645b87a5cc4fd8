//! In: addresses of cameras, robots and cells, templates and maps as careless and hostile people write them. Out:
//! each is answered within seconds by a result or by a fault that says what is wrong; nothing is run that an address
//! names.
//! Frame and unit: none.

use super::common::sheetlight_fails;
use sheetlight::raster::{Image, save_png};
use std::time::{Duration, Instant};

/// Words after the program's name, `{}` for a folder, and what the answer says.
const CASES: &[(&str, &str)] = &[
    ("record --camera gige:// --out {}/o", "names no camera"),
    ("record --camera gige://first?packet=9 --out {}/o", "576 to 16000"),
    ("record --camera ffmpeg: --out {}/o", "says not what ffmpeg is to open"),
    ("record --camera ffmpeg:;touch&{}/pwned --out {}/o --shots 1", "ffmpeg"),
    ("record --camera folder: --out {}/o", "names no folder"),
    ("record --camera folder:{}/none --out {}/o", "make the folder"),
    ("record --camera play: --out {}/o", "names no folder"),
    ("record --camera play:{} --out {}/o", "contains no meta.json"),
    ("record --camera cell:// --out {}/o", "names no port"),
    ("record --camera cell://127.0.0.1:1?rate=nan --out {}/o", "is not a number"),
    ("record --camera cell://127.0.0.1:99999 --out {}/o", "next step"),
    ("record --camera sim:1?rate=1e308 --out {}/o", "rate is 1e308; allowed: 0 to 1000"),
    ("record --camera sim:1?speed=-1 --out {}/o", "speed is -1e0; allowed: 0.001 to 10000"),
    ("record --camera sim:1?still=1.5 --out {}/o", "still is 1.5e0; allowed: 0 to 1"),
    ("record --camera sim:1?size=99999x9 --out {}/o", "size is"),
    ("record --camera - --out {}/o", "state it: --raw"),
    ("record --camera http://x --out {}/o", "known are"),
    ("match {}/even.png {}/even.png", "0 edge places"),
    ("match {}/even.png {}/even.png --angles 5..-5", "wanted ascending"),
    ("match {}/even.png {}/even.png --scales 0..0", "within 0.2 to 5"),
    ("match {}/even.png {}/even.png --score nan", "allowed: 0.1 to 1"),
    ("match {}/even.png {}/even.png --most 18446744073709551615", "allowed: 1 to 1000"),
    ("match {}/even.png {}/even.png --polygon nan,0,1,1,2,2", "corner"),
    ("match {}/even.png {}/even.png --out {}/even.png", "would replace"),
    ("import-map {}/even.png --out {}/o", "unit of the heights is not stated"),
    ("import-map {}/even.png --unit-mm nan --spacing-mm 1,1 --missing 0 --out {}/o", "allowed: 0.000001 to"),
    (
        "import-map {}/even.png --unit-mm 1 --spacing-mm 1e308,1 --missing 0 --out {}/o",
        "1e308 mm; allowed: 0.000001 to 1000000",
    ),
    ("import-map {}/even.png --unit-mm 1 --spacing-mm 0,1 --missing 0 --out {}/o", "0e0 mm; allowed:"),
    ("import-map {}/even.png --unit-mm 1 --spacing-mm 1,1 --out {}/o", "which level means"),
    ("import-map {}/even.png --unit-mm 1 --spacing-mm 1,1 --missing 0 --sigma-mm nan --out {}/o", "sigma"),
    ("import-map {}/even.png --unit-mm 1 --spacing-mm 1,1 --missing 128 --out {}/o", "missing"),
];

#[test]
fn addresses_templates_and_maps_that_are_none() {
    let dir = tempfile::tempdir().unwrap();
    save_png(&Image::from_u8(64, 48, vec![128; 64 * 48]), &dir.path().join("even.png")).unwrap();
    let here = dir.path().to_str().unwrap();
    let mut wrong = Vec::new();
    for (words, says) in CASES {
        let args: Vec<String> =
            words.split(' ').map(|w| w.replace('&', " ").replace("{}", here)).chain(["--quiet".into()]).collect();
        let since = Instant::now();
        let (code, said) = sheetlight_fails(&args.iter().map(String::as_str).collect::<Vec<_>>());
        let good = matches!(code, 1 | 2)
            && said.contains(says)
            && !said.contains("panicked")
            && (said.contains("next step") || said.contains("--help"))
            && since.elapsed() < Duration::from_secs(30);
        println!("{} {words:70} | {}", if good { "ok   " } else { "WRONG" }, said.lines().next().unwrap_or_default());
        if !good {
            wrong.push(format!("{words}: {code}, {said}"));
        }
    }
    assert!(!dir.path().join("pwned").exists(), "an address was run");
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), CASES.len(), wrong.join("\n"));
}
