//! In: tests/data/outside, a program that uses the library as others do, and a simulated station. Out: whether it
//! gets what `scan` gets. Its sources are compiled into this test too, which is quick; SHEETLIGHT_LONG=1 builds and
//! runs the program itself, without the features it does not ask for. Frame and unit: robot's base, mm.

#[allow(dead_code)]
#[path = "data/outside/src/main.rs"]
mod outside;

use outside::{Held, line, measure};
use sheetlight::recording::Recording;
use sheetlight::rig::Rig;
use sheetlight::scan::{HeightMap, RecordingSource, read_cloud};
use sheetlight::simulate::{Set, SimulateOptions, simulate};
use sheetlight::station::{ScanOptions, Settings, find_part, find_part_held, scan_held, scan_recording, shots_of};
use std::process::Command;

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
    measure(&station, Held::read(&recording).unwrap(), take).unwrap();
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
    let mut source = Held::read(&dir.path().join("scan")).unwrap();
    source.format.width += 2;
    let said = measure(&station, source, |_| panic!("a profile came")).unwrap_err();
    assert!(said.what.contains("642") && !said.next.is_empty(), "{said}");
}
