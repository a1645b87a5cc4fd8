//! In: tests/data/outside, a program that uses the library as others do, and a simulated station. Out: whether it
//! gets what `scan` gets. Its sources are compiled into this test too, which is quick; SHEETLIGHT_LONG=1 builds and
//! runs the program itself, without the features it does not ask for. Frame and unit: robot's base, mm.

#[allow(dead_code)]
#[path = "data/outside/src/main.rs"]
mod outside;

use outside::{Posed, line, measure, own};
use sheetlight::Scan;
use sheetlight::fault::Fault;
use sheetlight::raster::{Image, Pixels};
use sheetlight::recording::Recording;
use sheetlight::rig::{Rig, Volume};
use sheetlight::scan::{HeightMap, Profile, RecordingSource, Where, read_cloud};
use sheetlight::simulate::{Set, SimulateOptions, simulate};
use sheetlight::station::{ScanOptions, Settings, find_part, find_part_held, scan_held, scan_recording, shots_of};
use std::process::Command;
use std::sync::{Arc, Mutex};

#[test]
fn a_program_of_others_gets_the_points_that_scan_gets() {
    let dir = tempfile::tempdir().unwrap();
    let options = SimulateOptions { shots: 30, sets: vec![Set::Scan], ..SimulateOptions::default() };
    let station = simulate(dir.path(), &options, &|_, _| {}).unwrap().station;
    let recording = dir.path().join("scan");

    let (mut cloud, mut lines) = (Vec::new(), vec!["shot,z_mm,sigma_mm".to_owned()]);
    let take = |p: &sheetlight::scan::Profile| {
        cloud.extend(p.points.iter().copied());
        lines.extend(line(p));
    };
    measure(&station, own(&recording).unwrap(), take).unwrap();
    assert!(lines.len() > 24 && cloud.len() > 3000, "{} lines, {} points", lines.len(), cloud.len());

    let (mut settings, rig) = (Settings::load(&station).unwrap(), Rig::load(&station).unwrap());
    // Profiles are given as they are measured. What a whole cloud shows of its errors is corrected after the last one.
    (settings.extraction.straighten, settings.extraction.thick_sheet) = (false, false);
    let out = dir.path().join("result");
    let asked = ScanOptions { place: sheetlight::scan::Where::Cpu, ..ScanOptions::for_station(&settings, &rig, &out) };
    scan_recording(&Recording::open(&recording).unwrap(), None, &rig, &asked, |_, _| {}).unwrap();
    let scanned = read_cloud(&out.join("cloud.ply")).unwrap();
    assert!(cloud == scanned, "{} points against {}", cloud.len(), scanned.len());

    if std::env::var_os("SHEETLIGHT_LONG").is_none() {
        eprintln!("SHEETLIGHT_LONG=1 builds the program without default features and runs it: skipped");
        return;
    }
    let run = Command::new(env!("CARGO"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(["run", "--quiet", "--locked", "--offline", "--package", "outside", "--"])
        .args([recording.as_path(), station.as_path()])
        .output()
        .unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let said = String::from_utf8(run.stdout).unwrap();
    assert_eq!(said.lines().collect::<Vec<_>>(), lines);
}

#[test]
fn a_scan_in_memory_is_the_scan_in_a_folder() {
    let dir = tempfile::tempdir().unwrap();
    // Places that scatter: the refinement has something to take out.
    let options = SimulateOptions {
        shots: 120,
        sets: vec![Set::Scan],
        pose_noise_mm: 0.02,
        pose_noise_deg: 0.004,
        ..SimulateOptions::default()
    };
    let station = simulate(dir.path(), &options, &|_, _| {}).unwrap().station;
    let recording = Recording::open(&dir.path().join("scan")).unwrap();
    let (settings, rig) = (Settings::load(&station).unwrap(), Rig::load(&station).unwrap());
    let out = dir.path().join("result");
    let asked = ScanOptions { place: sheetlight::scan::Where::Cpu, ..ScanOptions::for_station(&settings, &rig, &out) };
    let report = scan_recording(&recording, None, &rig, &asked, |_, _| {}).unwrap();

    let mut source = RecordingSource::open(&recording, None, 0).unwrap();
    let mut told = Vec::new();
    let held = scan_held("x", &mut source, &rig, &asked, |done, all| told.push((done, all))).unwrap();
    assert_eq!(told.last(), Some(&(120, Some(120))));
    assert!(report.places.is_some_and(|p| p.taken_out), "the places do not scatter: {:?}", report.places);
    assert!(held.points == read_cloud(&out.join("cloud.ply")).unwrap());
    let bits = |map: &HeightMap| map.z.iter().chain(&map.sigma).map(|v| v.to_bits()).collect::<Vec<_>>();
    let (map, filed) = (held.map.as_ref().unwrap(), HeightMap::load(&out).unwrap());
    assert!(bits(map) == bits(&filed) && map.count == filed.count && map.cell == filed.cell);
    let places: Vec<u32> = shots_of(&out).unwrap().places().map(|(shot, _)| shot).collect();
    assert_eq!(held.shots.places().map(|(shot, _)| shot).collect::<Vec<_>>(), places);
    let said = |r: &sheetlight::station::ScanReport| (r.peaks.clone(), r.median_sigma_mm, r.places, r.sheet, r.shots);
    assert_eq!(format!("{:?}", said(&held.report)), format!("{:?}", said(&report)));

    let recipe = sheetlight::find::Recipe::load("data/recipes/led.toml".as_ref()).unwrap();
    let (in_memory, _) = find_part_held(&held, &recipe, Some(&rig), &Default::default()).unwrap();
    let (in_folder, _) = find_part(&out, &recipe, Some(&station), &Default::default()).unwrap();
    // Places that were refined go through the folder's file once more, which costs their last digits.
    let (turn, shift) = in_memory.base_from_part.difference(&in_folder.base_from_part);
    assert!(turn < 1e-9 && shift < 1e-9, "{turn} rad, {shift} mm");
    assert_eq!(in_memory.passed, in_folder.passed);
}

#[test]
fn another_picture_size_is_refused_before_a_shot_is_taken() {
    let dir = tempfile::tempdir().unwrap();
    let options = SimulateOptions { shots: 3, sets: vec![Set::Scan], ..SimulateOptions::default() };
    let station = simulate(dir.path(), &options, &|_, _| {}).unwrap().station;
    let wider = |(image, pose): Posed| {
        let mut levels = vec![0; 642 * 480];
        let Pixels::U8(narrow) = &image.pixels else { panic!("8 bits") };
        levels.chunks_mut(642).zip(narrow.chunks(640)).for_each(|(row, from)| row[..640].copy_from_slice(from));
        (Image::from_u8(642, 480, levels), pose)
    };
    let pictures = || own(&dir.path().join("scan")).unwrap();
    let never = |_: &Profile| panic!("a profile came");
    let said = measure(&station, pictures().map(|p| p.map(wider)), never).unwrap_err();
    assert!(said.what.contains("642") && !said.next.is_empty(), "{said}");
    // So are a picture that changes its size later, no picture, and an error of the program itself, in its own words.
    let later = pictures().enumerate().map(|(i, p)| if i < 2 { p } else { p.map(wider) });
    let said = measure(&station, later, never).unwrap_err();
    assert!(said.what.contains("picture 2 is 642x480"), "{said}");
    let said = measure(&station, [], never).unwrap_err();
    assert!(said.what.contains("no picture"), "{said}");
    let lost = || Err(Fault::device("the camera's cable was pulled").next("plug it in"));
    let said = Scan::at(&station).unwrap().pictures(pictures().chain([lost()])).err().unwrap();
    assert!(said.what.contains("cable") && said.next.contains("plug"), "{said}");
    let all: Vec<_> =
        Scan::at(&station).unwrap().profiles(pictures().take(1).chain([lost(), lost()])).unwrap().collect();
    assert!(all.len() == 1 && all[0].is_err(), "an error ends it: {}", all.len());
}

/// The same points from a recording, from its pictures and poses, and picture by picture.
#[test]
fn a_scan_says_what_is_different_and_takes_pictures() {
    let dir = tempfile::tempdir().unwrap();
    let options = SimulateOptions { shots: 40, sets: vec![Set::Scan], ..SimulateOptions::default() };
    let station = simulate(dir.path(), &options, &|_, _| {}).unwrap().station;
    let recording = Recording::open(&dir.path().join("scan")).unwrap();
    let told = Arc::new(Mutex::new(Vec::new()));
    let telling = told.clone();
    let scan = Scan::at(&station)
        .unwrap()
        .on(Where::Cpu)
        .cell_mm(0.5)
        .progress(move |done, all| telling.lock().unwrap().push((done, all)));
    let whole = scan.recording(&recording).unwrap();
    assert_eq!(told.lock().unwrap().last(), Some(&(40, Some(40))));
    assert_eq!(whole.map.as_ref().unwrap().cell, 0.5);
    let given = scan.pictures(own(&recording.folder).unwrap()).unwrap();
    assert!(given.points == whole.points && given.points.len() > 3000, "{} points", given.points.len());
    let out = dir.path().join("result");
    scan.recording_into(&recording, &out).unwrap();
    assert!(read_cloud(&out.join("cloud.ply")).unwrap() == whole.points);
    // The rig alone has the defaults of a station that states nothing.
    let of_rig = Scan::of(Rig::load(&station).unwrap()).on(Where::Cpu).volume(Volume::new(600.0, 650.0, "stated"));
    assert!(of_rig.pictures(own(&recording.folder).unwrap()).unwrap().points.is_empty(), "nothing is that far away");
    // A picture alone has its points in the camera's frame.
    let (picture, pose) = own(&recording.folder).unwrap().nth(20).unwrap().unwrap();
    let alone = scan.picture(picture).unwrap();
    let rig = Rig::load(&station).unwrap();
    let from_camera = pose * rig.hand_eye.unwrap().value;
    let of_shot: Vec<_> = whole.points.iter().filter(|p| p.shot == 20).collect();
    let kept = alone.peaks.iter().zip(&alone.points).filter(|(peak, _)| peak.kept());
    let near = |at: [f32; 3]| {
        let at = from_camera.point(&at.map(f64::from).into());
        of_shot.iter().any(|q| (q.at() - at).norm() < 0.2)
    };
    let found: Vec<bool> = kept.map(|(_, p)| near(p.position.to_array())).collect();
    let share = found.iter().filter(|near| **near).count() as f64 / found.len() as f64;
    assert!(found.len() > 100 && share > 0.97, "{share} of {} points", found.len());
}
