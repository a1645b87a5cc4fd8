//! In: nothing. Out: the cases of the stages of shape matching. Frame and unit: words.

use super::frame::*;
use crate::stages::entry::Case;
use crate::stages::noise::Noise;

/// Slopes of a synthetic level: two squares, noise below the threshold, a corner without slopes.
fn slopes(frame: &ShapeFrame, seed: u64) -> Vec<u32> {
    let mut noise = Noise(seed);
    let (w, h) = (frame.width as i32, frame.height as i32);
    let mut out = Vec::new();
    for y in 0..h {
        for x in 0..w {
            let around = |cx: i32, cy: i32, r: i32| {
                let (dx, dy) = (x - cx, y - cy);
                let edge = dx.abs().max(dy.abs()) - r;
                (edge == 0).then_some(if dx.abs() >= dy.abs() {
                    (dx.signum() * 500, dy * 9)
                } else {
                    (dx * 9, dy.signum() * 500)
                })
            };
            let grain = |n: &mut Noise| (n.next() % 61) as i32 - 30;
            let strong = around(w / 3, h / 2, h / 4).or(around(2 * w / 3, h / 3, h / 6));
            let (gx, gy) = strong.unwrap_or_else(|| (grain(&mut noise), grain(&mut noise)));
            // In one of eleven cells any direction with any strength.
            let (gx, gy) = if noise.next().is_multiple_of(11) {
                ((noise.next() % 16383) as i32 - 8191, (noise.next() % 16383) as i32 - 8191)
            } else {
                (gx, gy)
            };
            let known = x + y > 9;
            out.push(if known { crate::stages::shape::maps::packed(gx, gy) } else { 0 });
        }
    }
    out
}

/// Cases of one stage; the stages before it are run by their twins.
pub fn cases(stage: &str) -> Vec<Case> {
    let mut out = Vec::new();
    for (seed, (w, h, margin, ignore)) in
        [(96, 64, 0, 0), (61, 47, 12, 0), (130, 33, 7, 1), (5, 9, 3, 0)].into_iter().enumerate()
    {
        let mut frame = ShapeFrame::new(w, h, margin);
        frame.ignore = ignore;
        frame.features = 17;
        frame.turns = 5;
        frame.least = 9;
        frame.capacity = 4096;
        let mut noise = Noise(90 + seed as u64);
        let features: Vec<[i32; 4]> = (0..frame.features * frame.turns)
            .map(|_| {
                let mut within = |n: u32| i64::from(noise.next() % (2 * n + 1)) - i64::from(n);
                let (dx, dy) = (within(40), within(40));
                frame.feature(0, (noise.next() % BINS as u32) as usize, dx, dy)
            })
            .collect();
        let uniform = bytemuck::cast_slice(&[frame]).to_vec();
        let groups = |n: usize, y: u32| [(n as u32).div_ceil(64), y, 1];
        let mut case =
            |name: &str, bindings: Vec<Vec<u32>>, groups, twin: fn(&mut [Vec<u32>], &[(&'static str, f64)])| {
                let mut done = bindings.clone();
                twin(&mut done, &[]);
                if name == stage {
                    out.push(Case { name: format!("{w} x {h}, margin {margin}"), overrides: vec![], bindings, groups });
                }
                done
            };
        let cells = vec![uniform.clone(), slopes(&frame, seed as u64), vec![0; w * h]];
        let done = case("shape_quantise", cells, groups(w * h, 1), crate::stages::shape::maps::quantise_twin);
        let maps = vec![uniform.clone(), done[2].clone(), vec![0; frame.layer_words()]];
        let done = case("shape_spread", maps, groups(frame.plane(), 16), crate::stages::shape::maps::spread_twin);
        let sums = vec![0; frame.plane() * frame.turns as usize];
        let sums = vec![uniform.clone(), done[2].clone(), bytemuck::cast_slice(&features).to_vec(), sums];
        let done =
            case("shape_score", sums, groups(frame.plane(), frame.turns), crate::stages::shape::sums::score_twin);
        let list = vec![0; 2 * frame.capacity as usize];
        let peaks = vec![uniform, done[3].clone(), vec![0; 4], list];
        case("shape_peaks", peaks, groups(frame.plane(), frame.turns), crate::stages::shape::sums::peaks_twin);
    }
    out
}
