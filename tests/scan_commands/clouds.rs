//! In: simulated scans of the designs in data/rigs. Out: the GPU and the processor of this machine give the same
//! cloud, whole.
//! Frame and unit: mm, and pixel footprints of the rig. SHEETLIGHT_LONG: every design, in its own size.

use crate::common;
use crate::common::clouds::apart;
use crate::common::sheetlight;
use sheetlight::scan::{CloudPoint, read_cloud};
use std::path::Path;

/// Lying, upright, askew, bent by a barrel lens, behind a tilted sensor, narrower than a pixel.
const SHORT: [&str; 6] = ["barrel", "behind", "fine", "scheimpflug", "slant45", "upright"];
/// Of a footprint: 0.001 mm at the reference rigs' pixel of 0.25 mm. What the fit's rule of ending leaves beyond it:
/// a fit whose last step is as long as the rule's limit, half a hundredth of the stripe's width, ends a step earlier
/// on one side. Stripes are up to a pixel wide here, and a pixel moves a point on a sheet at 30 degrees by two
/// footprints.
const APART: f64 = 0.004;
const ONE_STEP: f64 = 0.02;
/// So few points may have ended so, of a thousand.
const ENDED_EARLIER: usize = 1;

#[test]
fn every_rig_has_one_cloud_on_both_processors() {
    if common::device().is_none() {
        return;
    }
    let long = std::env::var_os("SHEETLIGHT_LONG").is_some();
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join("data/rigs");
    let mut designs: Vec<_> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    designs.sort();
    let (mut points, mut alone) = (0, 0);
    let mut faults = Vec::new();
    for file in designs {
        let name = file.file_stem().unwrap().to_str().unwrap();
        if !long && !SHORT.contains(&name) {
            continue;
        }
        let dir = tempfile::tempdir().unwrap();
        let at = |part: &str| dir.path().join(part).to_str().unwrap().to_owned();
        let (rig, out) = (file.to_str().unwrap(), at(""));
        let mut args = vec!["simulate", "--rig", rig, "--out", &out, "--set", "scan", "--quiet"];
        if !long {
            args.extend(["--width", "320", "--shots", "12"]);
        }
        sheetlight(&args);
        let [gpu, twins] = ["gpu", "cpu"].map(|on| {
            let to = at(on);
            let (scan, station) = (at("scan"), at("station"));
            sheetlight(&["scan", &scan, "--station", &station, "--out", &to, "--on", on, "--overlays", "0", "--quiet"]);
            read_cloud(&Path::new(&to).join("cloud.ply")).unwrap()
        });
        // What a pixel sees of the parts, from the points themselves: neighbours on a line lie that far from each
        // other.
        let mut steps: Vec<f64> = twins.windows(2).filter(|w| w[0].shot == w[1].shot).map(spacing).collect();
        let middle = steps.len() / 2;
        let footprint = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
        let a = apart(&gpu, &twins);
        let off = a.worst_mm / footprint;
        println!("{name}: {} points, {} equal, {} alone, {off:.6} px apart at most", twins.len(), a.equal, a.alone);
        let far = farther(&gpu, &twins, APART * footprint);
        println!("{name}: {far} farther than {APART} px");
        let ended = far * 1000 > ENDED_EARLIER * twins.len().max(1000) || off > ONE_STEP;
        (points, alone) = (points + twins.len(), alone + a.alone);
        if twins.len() < 500 || ended {
            faults.push(format!("{name}: {a:?} of {} points, footprint {footprint:.4} mm", twins.len()));
        }
    }
    // One of twenty thousand may lie on a limit of the choice.
    if alone * 20_000 > points {
        faults.push(format!("{alone} of {points} points on one side alone"));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// How many points of two clouds with as many are farther apart than this, mm.
fn farther(a: &[CloudPoint], b: &[CloudPoint], mm: f64) -> usize {
    let apart = |(p, q): &(&CloudPoint, &CloudPoint)| {
        (0..3).map(|k| f64::from(p.position[k] - q.position[k]).powi(2)).sum::<f64>().sqrt() > mm
    };
    if a.len() == b.len() { a.iter().zip(b).filter(apart).count() } else { 0 }
}

/// Distance of two points over that of their pixels, mm per px.
fn spacing(w: &[CloudPoint]) -> f64 {
    let mm = (0..3).map(|k| f64::from(w[0].position[k] - w[1].position[k]).powi(2)).sum::<f64>().sqrt();
    mm / f64::from((w[0].u - w[1].u).hypot(w[0].v - w[1].v)).max(0.5)
}
