//! In: simulated recordings, small and odd ones and deep ones. Out: the scan on the GPU and the scan on the
//! CPU twins give the same points. Frame and unit: base frame, mm; pixels.

mod common;

use common::sheetlight;
use sheetlight::scan::{CloudPoint, read_cloud};
use std::collections::BTreeMap;

/// Points by shot and pixel of the peak, which is unique within half a pixel.
fn by_place(points: &[CloudPoint]) -> BTreeMap<(u32, i32, i32), &CloudPoint> {
    points.iter().map(|p| ((p.shot, (p.u * 8.0).round() as i32, (p.v * 8.0).round() as i32), p)).collect()
}

fn agree(name: &str, simulate: &[&str]) {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).to_str().unwrap().to_owned();
    let out = at("sim");
    sheetlight(&[&["simulate", "--out", &out, "--quiet"], simulate].concat());
    let scan = |place: &str| {
        let args = [
            "scan",
            &at("sim/scan"),
            "--station",
            &at("sim/station"),
            "--out",
            &at(place),
            "--on",
            place,
            "--overlays",
            "0",
        ];
        sheetlight(&args);
        read_cloud(&dir.path().join(place).join("cloud.ply")).unwrap()
    };
    let (gpu, cpu) = (scan("gpu"), scan("cpu"));
    assert!(cpu.len() > 1000, "{name}: {} points", cpu.len());
    // A peak on the edge of a test may fall on either side of it; one in a thousand is plenty for that.
    let lost = gpu.len().abs_diff(cpu.len());
    assert!(lost * 1000 <= cpu.len(), "{name}: {} points on the GPU, {} on the twins", gpu.len(), cpu.len());
    let (a, b) = (by_place(&gpu), by_place(&cpu));
    let both: Vec<_> = a.iter().filter_map(|(k, p)| b.get(k).map(|q| (p, q))).collect();
    // Places are rounded to eighths; peaks beside a rounding edge find no partner, whatever agrees.
    assert!(both.len() * 100 >= cpu.len() * 98, "{name}: {} of {} points have a partner", both.len(), cpu.len());
    let apart =
        |p: &CloudPoint, q: &CloudPoint| (0..3).map(|i| (p.position[i] - q.position[i]).powi(2)).sum::<f32>().sqrt();
    let worst = both.iter().map(|(p, q)| apart(p, q)).fold(0f32, f32::max);
    println!("{name}: {} points, largest difference {worst:.5} mm", cpu.len());
    assert!(worst < 0.005, "{name}: points differ by {worst} mm");
}

#[test]
fn gpu_and_twins_give_the_same_points() {
    if sheetlight::gpu::Device::open().is_err() {
        assert!(std::env::var_os("SHEETLIGHT_REQUIRE_GPU").is_none(), "no GPU adapter");
        eprintln!("*** SKIPPED: no GPU adapter ***");
        return;
    }
    agree("640x480", &["--shots", "40"]);
    agree("641x479", &["--shots", "21", "--width", "641", "--height", "479", "--seed", "3"]);
    agree("12 bits", &["--shots", "20", "--bits", "12", "--seed", "5"]);
}
