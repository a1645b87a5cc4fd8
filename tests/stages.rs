//! In: every stage with its cases. Out: GPU and CPU twin agree, and the chain of twins agrees with the
//! plain definition. Frame and unit: words, pixels.

mod common;

use sheetlight::fault::Result;
use sheetlight::gpu::Device;
use sheetlight::stages;
use sheetlight::stages::stripe::{skeleton, spacing, thin, threshold};
use sheetlight::stages::{Entry, Frame, ThresholdParams, Verdict, cases};

#[test]
fn every_stage_equals_its_twin() {
    let Some(device) = common::device() else { return };
    agree(&device);
}

/// Mesa's software adapter reads arrays as texels; every other one as what they are, which is judged here as well.
#[test]
fn every_stage_that_reads_buffers_equals_its_twin() {
    let Some(device) = common::device() else { return };
    let mesa = cfg!(target_os = "linux") && device.info.name.starts_with("llvmpipe");
    assert!(device.reads_texels || !mesa, "the trial of texels failed on {}", device.info.name);
    agree(&device.without_texels());
}

/// What every rig makes of a stripe: widths, directions and depths, both ways of reading arrays.
#[test]
fn peaks_of_every_width_direction_and_depth_equal_their_twin() {
    let Some(device) = common::device() else { return };
    let space = if std::env::var_os("SHEETLIGHT_LONG").is_some() { cases::Space::Whole } else { cases::Space::Pairs };
    for device in [&device, &device.without_texels()] {
        judge(&["lines", "peak", "point"], |e| e.judge(device, cases::ruled(e.stage.name, space)));
    }
}

fn agree(device: &Device) {
    judge(&[], |e| e.verify(device));
}

/// The stages of these names, or all.
fn judge(names: &[&str], verdict: impl Fn(&Entry) -> Result<Verdict>) {
    let mut failed = Vec::new();
    for entry in stages::all().iter().filter(|e| names.is_empty() || names.contains(&e.stage.name)) {
        let v = verdict(entry).unwrap();
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
                    stages::stripe::ambient::subtract(v, a, u32::from(shot.full_scale()))
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
            // The list is that of the lines carried on, or of what is chosen of them.
            let long = walk.frame.unpack_mask(&walk.buffers["long"], i as u32);
            let mut kept = thinned.clone();
            kept.intersect(&long);
            assert!(kept == thinned, "{}, shot {i}: carrying on takes nothing away", scene.name);
            let chosen = if scene.spacing == 0 { long } else { spacing::twin(&lit, &long, scene.spacing) };
            let list = skeleton::twin(&chosen);
            let header = &walk.buffers["header"];
            let (from, to) = (header[skeleton::HEADER + i] as usize, header[skeleton::HEADER + 1 + i] as usize);
            let points = &walk.buffers["pixels"][2 * from..2 * to];
            assert!(points.iter().step_by(2).copied().eq(list), "{}, shot {i}: points", scene.name);
            assert!(points.iter().skip(1).step_by(2).all(|&s| s == i as u32));
        }
    }
}

/// The proof that a block is dark rests on this: no window around any of its pixels sums to less than the bound. On a
/// plain picture the two are equal, and the bound is worth having only if it is never far below.
#[test]
fn window_sums_are_never_below_their_bound() {
    let mut noise = sheetlight::stages::noise::Noise(5);
    for (size, width, height) in [(3, 70, 41), (9, 70, 41), (15, 64, 48), (31, 101, 83), (33, 96, 64), (101, 161, 120)]
    {
        for amplitude in [1, 40, 196] {
            let image = cases::drawn(width, height, 8, |_, _| 60 + noise.next() % amplitude);
            let params = ThresholdParams { size, ..ThresholdParams::default() };
            let frame = Frame::new(width, height, 8, 1, &params).unwrap();
            let mut words = vec![0u8; frame.image_bytes()];
            frame.pack_image(&image, &mut words).unwrap();
            let n = frame.tiles() as usize;
            let uniform = bytemuck::cast_slice::<Frame, u32>(&[frame]).to_vec();
            let mut bindings = vec![uniform, bytemuck::pod_collect_to_vec(&words), vec![0; 4 * n]];
            stages::stripe::stats::twin(&mut bindings, &[(stages::frame::PX_LOG2, 2.0)]);
            let blocks = stages::stripe::bound::Blocks::new(&frame, &bindings[2], 0);
            let r = (size / 2) as i32;
            let at = |x: i32, y: i32| {
                u32::from(image.get(x.clamp(0, width as i32 - 1) as u32, y.clamp(0, height as i32 - 1) as u32))
            };
            // Large windows are looked at on a grid that no block's edge repeats.
            let step = if size > 31 { 5 } else { 1 };
            for y in (0..height as i32).step_by(step) {
                for x in (0..width as i32).step_by(step) {
                    let sum: u32 = (-r..=r).map(|dy| (-r..=r).map(|dx| at(x + dx, y + dy)).sum::<u32>()).sum();
                    let bound = blocks.least_sum(x / 16, y / 8);
                    assert!(bound <= sum, "window {size} at ({x}, {y}): bound {bound}, sum {sum}");
                    let least = if amplitude == 1 {
                        sum
                    } else if size == 31 {
                        sum / 2
                    } else {
                        0
                    };
                    assert!(bound >= least, "window {size} at ({x}, {y}): bound {bound} far below {sum}");
                }
            }
        }
    }
}
