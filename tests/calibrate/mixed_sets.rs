//! Sets in which some pictures were turned, mirrored, cropped or refocused are named; right sets never are, of bent
//! boards neither.

use crate::camera_judge::{Station, random_station, seen};
use crate::common::judge::between;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use sheetlight::calibrate::camera::intrinsics::{Observation, SolveOptions, solve};
use sheetlight::calibrate::camera::parts::apart;
use sheetlight::calibrate::camera::procedure::{CameraOptions, calibrate, from_observations};
use sheetlight::camera::Intrinsics;
use sheetlight::geometry::{Vec2, Vec3};
use sheetlight::recording::Recording;
use std::sync::Arc;

const KINDS: [&str; 5] = ["turned by 180", "mirrored left", "mirrored top", "region", "focal length"];

/// A board of 9x6 corners reads a mirrored picture as another one of itself.
fn mirrored(o: &mut Observation) {
    for p in &mut o.view.points {
        p.feature_id = p.feature_id / 9 * 9 + 8 - p.feature_id % 9;
    }
    o.view.points.sort_by_key(|p| p.feature_id);
}

/// Pictures of a station, some of them of kind `kind` of [`KINDS`]; which ones.
fn mixed(s: &Station, kind: usize, seed: u64) -> (Vec<Observation>, Vec<usize>) {
    let mut rng = Pcg64::seed_from_u64(seed);
    let n = s.poses.len();
    let count = ((n as f64 * between(&mut rng, 0.1, 0.5)) as usize).max(1);
    let first = rng.random_range(0..=n - count);
    // One after the other, or anywhere.
    let mut which: Vec<usize> = if rng.random::<bool>() {
        (first..first + count).collect()
    } else {
        rand::seq::index::sample(&mut rng, n, count).into_vec()
    };
    which.sort_unstable();
    let share = between(&mut rng, 0.005, 0.02) * if rng.random::<bool>() { 1.0 } else { -1.0 };
    let refocused = Intrinsics { fx: s.camera.fx * (1.0 + share), fy: s.camera.fy * (1.0 + share), ..s.camera };
    let cropped = Vec2::new(between(&mut rng, 4.0, 60.0).round(), between(&mut rng, -40.0, 40.0).round());
    let (w, h) = (f64::from(s.camera.width) - 1.0, f64::from(s.camera.height) - 1.0);
    let mut pictures = seen(s, seed);
    let others = seen(&Station { camera: refocused, features: s.features.clone(), poses: s.poses.clone(), ..*s }, seed);
    for &i in &which {
        if kind == 4 {
            pictures[i] = others[i].clone();
        }
        let o = &mut pictures[i];
        for p in &mut o.view.points {
            let [x, y] = [p.pixel.x, p.pixel.y];
            p.pixel = match kind {
                0 => Vec2::new(w - x, h - y),
                1 => Vec2::new(w - x, y),
                2 => Vec2::new(x, h - y),
                3 => p.pixel - cropped,
                _ => p.pixel,
            };
        }
        if matches!(kind, 1 | 2) {
            mirrored(o);
        }
    }
    (pictures, which)
}

/// What is said of the set: all of it, and which pictures are named in it; how far its camera is off, in stated sigmas.
fn said(pictures: Vec<Observation>, s: &Station) -> (String, Vec<usize>, f64) {
    let n = pictures.len();
    let [w, h] = [s.camera.width, s.camera.height];
    let result = from_observations(pictures, Vec::new(), w, h, &CameraOptions::default());
    let off = result.as_ref().map_or(f64::INFINITY, |r| {
        let (is, truth) = (r.calibration.value.parameters(), s.camera.parameters());
        let sigma = |i: usize| r.solved.covariance.map_or(0.0, |c| c[(i, i)].sqrt());
        (0..4).map(|i| (is[i] - truth[i]).abs() / sigma(i)).fold(0.0, f64::max)
    });
    let text = match result {
        Ok(r) => r.left_out.iter().map(|(name, why)| format!("left out {name}, {why}; ")).collect(),
        Err(fault) => fault.to_string(),
    };
    let words: Vec<&str> = text.split(|c: char| !c.is_alphanumeric()).collect();
    let named = |i: &usize| words.windows(2).any(|w| w[0] == "picture" && w[1] == i.to_string());
    (text.clone(), (0..n).filter(named).collect(), off)
}

/// A turn about a middle that is the principal point changes nothing: the set is then right.
fn matters(s: &Station, kind: usize) -> bool {
    let off = |c: f64, size: u32| (c - (f64::from(size) - 1.0) / 2.0).abs() > 1.5;
    let (x, y) = (off(s.camera.cx, s.camera.width), off(s.camera.cy, s.camera.height));
    [x || y, x, y, true, true][kind]
}

#[test]
fn pictures_that_were_read_out_otherwise_are_named() {
    let sets = if std::env::var_os("SHEETLIGHT_LONG").is_some() { 100 } else { 10 };
    let (mut all, mut exact, mut harmless, mut missed) = (0, 0, 0, Vec::new());
    for k in 0..sets {
        let (kind, seed) = (k as usize % KINDS.len(), 60_000 + k);
        let mut s = random_station(seed);
        s.sigma_px = s.sigma_px.min(0.1);
        if !matters(&s, kind) {
            continue;
        }
        all += 1;
        let (pictures, which) = mixed(&s, kind, seed);
        let (text, named, off) = said(pictures, &s);
        exact += usize::from(named == which || 2 * which.len() == s.poses.len());
        // Refused, or the pictures left out.
        let told = text.contains("do not fit the other pictures' camera") || named == which;
        // Where nearly half of the pictures are others, nobody knows which half is right.
        let turned = text.contains("pictures do not fit") && named.iter().any(|i| !which.contains(i));
        assert!(!turned || text.contains("or the others were"), "{k}: {which:?}, named {named:?}: {text}");
        // A small change of a few pictures that tell little of it: the camera is as good as it says all the same.
        harmless += usize::from(!told && off < 3.0);
        if !told && off >= 3.0 {
            let (n, sigma) = (s.poses.len(), s.sigma_px);
            missed.push(format!(
                "{k}: {} of {which:?} of {n}, {sigma:.2} px, off {off:.1}, named {named:?}: {text}",
                KINDS[kind]
            ));
        }
    }
    let told = all - missed.len() - harmless;
    println!("{told} of {all} mixed sets refused or sorted, {exact} by the right pictures; {harmless} did no harm");
    assert!(missed.len() * 100 <= 3 * all.max(34), "{} of {all} not named:\n{}", missed.len(), missed.join("\n"));
}

#[test]
fn right_sets_are_never_accused() {
    let sets = if std::env::var_os("SHEETLIGHT_LONG").is_some() { 200 } else { 8 };
    for k in 0..sets {
        let mut s = random_station(70_000 + k);
        let flat = s.features.clone();
        // Every second board is bent by up to a millimetre and printed a little long.
        if k % 2 == 1 {
            let bow = between(&mut Pcg64::seed_from_u64(k), 0.1, 1.0);
            let bent = |x: &Vec3| {
                let (u, v) = ((x.x - 60.0) / 60.0, (x.y - 37.5) / 60.0);
                *x + Vec3::new(0.02 * v, 0.12 * v, bow * ((1.2 * (u + 0.4 * v)).cos() - 1.0))
            };
            s.features = Arc::new(flat.iter().map(bent).collect());
        }
        let mut pictures = seen(&s, 70_000 + k);
        pictures.iter_mut().for_each(|o| o.features = flat.clone());
        let options = SolveOptions::default();
        let solved = solve(&pictures, s.camera.width, s.camera.height, &options).unwrap();
        assert_eq!(apart(&pictures, &solved, &options), None, "{k}");
    }
}

/// Photographs of one camera, half of them turned by the program that saved them.
#[test]
fn photographs_half_of_which_are_turned_are_refused() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/half_turned");
    let recording = Recording::open(&folder).unwrap();
    let fault = calibrate(&[recording], &CameraOptions::default(), &|_, _| ()).unwrap_err();
    assert!(fault.what.contains("turned by 180 degrees"), "{fault}");
    assert!(fault.what.starts_with("5 of 10 pictures"), "{fault}");
}

/// A real stereo pair's photographs in one set: those of the other camera are named, all of them and no others.
#[test]
fn photographs_of_two_cameras_in_one_set_are_told_apart() {
    let Some(reference) = crate::common::reference("photographs_of_two_cameras_in_one_set_are_told_apart") else {
        return;
    };
    let photographs = reference.join("camera/opencv_chessboard");
    let all = |side: &str| [1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 12, 13, 14].map(|k| format!("{side}{k:02}.jpg")).to_vec();
    let (left, right) = (all("left"), all("right"));
    let calibrated = |names: &[String]| {
        let folder = tempfile::tempdir().unwrap();
        names.iter().for_each(|n| {
            std::fs::copy(photographs.join(n), folder.path().join(n)).unwrap();
        });
        let frames: Vec<_> = names.iter().map(|n| serde_json::json!({ "ambient": n })).collect();
        let meta = serde_json::json!({
            "format": 1, "set": "two cameras", "units": "mm", "frames": frames,
            "image": { "width": 640, "height": 480, "bits": 8, "channels": 1, "response": "linear",
                       "pixel_centre": "integer coordinates" },
            "board": { "type": "chessboard", "inner_corners": [9, 6], "square_mm": 25.0, "border_mm": 10.0,
                       "first_square": "black" },
        });
        std::fs::write(folder.path().join("meta.json"), meta.to_string()).unwrap();
        let recording = Recording::open(folder.path()).unwrap();
        calibrate(&[recording], &CameraOptions::default(), &|_, _| ())
    };
    for alone in [&left, &right] {
        assert_eq!(calibrated(alone).unwrap().left_out, [], "photographs of one camera were accused");
    }
    let few = calibrated(&[&left[..], &right[..3]].concat()).unwrap();
    let mut named: Vec<&String> = few.left_out.iter().map(|(name, _)| name).collect();
    named.sort();
    assert_eq!(named, right[..3].iter().collect::<Vec<_>>(), "{:?}", few.left_out);
    // Three pictures do not tell another lens from another region.
    assert!(few.left_out.iter().all(|(_, why)| why.contains("px further")), "{:?}", few.left_out);
    let half = calibrated(&[&left[..7], &right[7..]].concat()).unwrap_err();
    assert!(half.what.starts_with("6 of 13 pictures") && half.what.contains("px further"), "{half}");
}
