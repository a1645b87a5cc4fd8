//! In: real photographs of a cube, of steps and of nothing on a moving bed. Out: their heights by the stripe's shift,
//! against calliper and nominal values.
//! Frame and unit: above the bed, mm. The geometry is the one that the photographs' author published.

use crate::common::reference;
use sheetlight::raster::Channel;
use sheetlight::scan::{ShiftReport, ShiftRig, Side, shift_scan};
use std::path::Path;

fn scan(folder: &Path, name: &str, empty: Option<&str>, channel: Channel) -> ShiftReport {
    let rig = ShiftRig {
        pixels_per_mm: 10.6277,
        camera_height_mm: 80.0,
        baseline_mm: 37.3,
        raises: Side::Left,
        travel_mm: 1.0,
        bed_rows: vec![[5, 40], [440, 475]],
        channel,
    };
    let empty = empty.map(|e| folder.join(e));
    shift_scan(&folder.join(name), empty.as_deref(), &rig, 1.0, &mut |_, _| {}).unwrap().0
}

#[test]
fn real_photographs_give_the_cube_and_the_steps() {
    let Some(reference) = reference("real step scans") else { return };
    let folder = reference.join("laser/step_scans");
    // The geometry is three numbers by ruler, the top surfaces glare; the author's own results for the steps
    // are 0.30, 0.01 and 0.03 mm off the calliper.
    for (name, want, allowed, empty) in [
        ("cube_20mm", 20.0, 0.15, "empty_bed"),
        ("video_grey_step_3.68mm", 3.68, 0.1, "video_reference"),
        ("video_grey_step_8.94mm", 8.94, 0.1, "video_reference"),
        ("video_grey_step_14mm", 14.0, 0.1, "video_reference"),
    ] {
        for (channel, empty) in [(Channel::Luma, None), (Channel::Red, None), (Channel::Luma, Some(empty))] {
            let report = scan(&folder, name, empty, channel);
            let p = report.plateau.unwrap_or_else(|| panic!("{name}: no level surface, {report:?}"));
            println!(
                "{name:24} {channel:?} {empty:?}: {:.3} mm, want {want} ({:+.3}); noise {:.3}, between pictures \
                 {:.3} mm, {} points in {} pictures; bed {:.3} mm",
                p.height_mm,
                p.height_mm - want,
                p.noise_mm,
                p.between_shots_mm,
                p.points,
                p.shots,
                report.bed_noise_mm
            );
            assert!((p.height_mm - want).abs() < allowed, "{name} {channel:?} {empty:?}: {}", p.height_mm);
            assert!(p.points > 1000, "{name}: {} points", p.points);
        }
    }
}

#[test]
fn nothing_stands_on_an_empty_bed() {
    let Some(reference) = reference("real step scans") else { return };
    let folder = reference.join("laser/step_scans");
    for channel in [Channel::Luma, Channel::Red, Channel::Green, Channel::Blue] {
        let report = scan(&folder, "empty_bed", None, channel);
        assert!(report.plateau.is_none(), "{channel:?}: {:?}", report.plateau);
    }
    let report = scan(&folder, "video_reference", None, Channel::Luma);
    assert!(report.plateau.is_none(), "{:?}", report.plateau);
}
