//! In: every stage with its cases. Out: GPU and CPU twin agree, and the chain of twins agrees with the
//! plain definition. Frame and unit: words, pixels.

mod common;

use sheetlight::stages::{self, cases, skeleton, thin, threshold};

#[test]
fn every_stage_equals_its_twin() {
    let Some(device) = common::device() else { return };
    let mut failed = Vec::new();
    for entry in stages::all() {
        let v = entry.verify(&device).unwrap();
        println!("{:20} {:3} cases, largest difference {} of {}", v.stage, v.cases, v.largest_difference, v.limit);
        assert!(v.cases > 0, "{} has no case", v.stage);
        if !v.passed() {
            failed.push(format!("{}: {} > {} in '{}'", v.stage, v.largest_difference, v.limit, v.worst_case));
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

#[test]
fn the_chain_of_twins_is_the_plain_definition() {
    for scene in cases::scenes() {
        let mut walk = cases::Walk::new(&scene);
        walk.run("");
        for (i, shot) in scene.shots.iter().enumerate() {
            let shot = match &scene.ambient {
                None => shot.clone(),
                Some(a) => cases::drawn(shot.width, shot.height, shot.bits, |x, y| {
                    let (v, a) = (u32::from(shot.get(x, y)), u32::from(a.get(x, y)));
                    stages::ambient::subtract(v, a, u32::from(shot.full_scale()))
                }),
            };
            let mut lit = threshold::twin(&shot, &scene.params);
            if scene.flags & stages::frame::HAS_ROI != 0 {
                lit.intersect(&walk.frame.unpack_mask(&walk.buffers["roi"], 0));
            }
            let thinned = thin::twin(&lit, scene.thinning);
            assert!(
                walk.frame.unpack_mask(&walk.buffers["mask"], i as u32) == thinned,
                "{}, shot {i}: mask",
                scene.name
            );
            let list = skeleton::twin(&thinned);
            let header = &walk.buffers["header"];
            let (from, to) = (header[skeleton::HEADER + i] as usize, header[skeleton::HEADER + 1 + i] as usize);
            let points = &walk.buffers["points"][2 * from..2 * to];
            assert!(points.iter().step_by(2).copied().eq(list), "{}, shot {i}: points", scene.name);
            assert!(points.iter().skip(1).step_by(2).all(|&s| s == i as u32));
        }
    }
}
