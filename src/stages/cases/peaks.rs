//! In: the scenes with a stripe; straight stripes of every width, direction and depth. Out: the cases of the stages
//! after the skeleton. Frame and unit: pixels, words.

use super::scenes::{Scene, drawn, optics, pose, tilted};
use super::walk::Walk;
use crate::stages::frame::{self, px_log2};
use crate::stages::listing;
use crate::stages::noise::Noise;
use crate::stages::peak::params::{Method, PeakParams};
use crate::stages::stripe::optics::PointFrame;
use crate::stages::stripe::point::Optics;
use crate::stages::stripe::{choose, point};
use crate::stages::{Case, Thinning, ThresholdParams, peak};

/// Properties of a stripe and its rig that the stages are given.
struct Told {
    width_px: f32,
    optics: Optics,
}

/// The cases of one of the stages after the skeleton, with every method, on the scenes with a stripe. The other scenes
/// have noise and edges, on which the result of a fit is arbitrary.
pub fn peaks(stage: &str) -> Vec<Case> {
    let scenes = super::scenes();
    let striped = scenes.iter().filter(|s| s.name.contains("stripe"));
    // Only the stage `point` uses the lens.
    let rigs: &[fn(u32, u32) -> Optics] = if stage == point::STAGE.name { &[optics, tilted] } else { &[optics] };
    let told = |s: &Scene, rig: &fn(u32, u32) -> Optics| Told {
        width_px: 3.0,
        optics: rig(s.shots[0].width, s.shots[0].height),
    };
    striped.flat_map(|s| rigs.iter().flat_map(move |r| cases(s.name, s, &told(s, r), &Method::ALL, stage))).collect()
}

/// Profile sigmas, px: together they have every number of quads, and of rows per sample.
const WIDTHS: [f64; 8] = [0.8, 1.0, 1.5, 2.0, 2.5, 3.3, 5.0, 9.0];
/// A few degrees off the image axes, so that the skeleton passes every place within a word. Each entry has the stripe's
/// angle, then the angle of a stripe on a level surface. In the last entry, a wall, they differ: the stripe is upright
/// where the rig's stripe lies.
const DIRECTIONS: [(&str, f64, f32); 4] =
    [("lying", 4.0, 0.0), ("upright", 86.0, 90.0), ("at 45 degrees", 45.0, 45.0), ("a wall", 86.0, 0.0)];
const DEPTHS: [u8; 4] = [8, 10, 12, 16];

/// Which combinations of width, direction, depth and method are tested.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Space {
    /// Any two values of width, direction and depth occur together in at least one case.
    Pairs,
    /// Every width with every direction, depth and method.
    Whole,
}

/// Cases of straight stripes of every width, direction and depth.
pub fn ruled(stage: &str, space: Space) -> Vec<Case> {
    let mut all = Vec::new();
    for (i, sigma) in WIDTHS.into_iter().enumerate() {
        for (j, bits) in DEPTHS.into_iter().enumerate() {
            for (k, (name, angle_deg, level_deg)) in DIRECTIONS.into_iter().enumerate() {
                let methods = match space {
                    Space::Whole => &Method::ALL[..],
                    Space::Pairs if k != (i + j) % 4 => continue,
                    Space::Pairs if i % 4 == j => &[Method::Gaussian, Method::ALL[1 + i % 3]],
                    Space::Pairs => &[Method::Gaussian],
                };
                let name = format!("{sigma} px, {name}, {bits} bits");
                let scene = straight(sigma, angle_deg, bits);
                let told = Told { width_px: sigma as f32, optics: rig(scene.shots[0].width, level_deg) };
                all.extend(cases(&name, &scene, &told, methods, stage));
            }
        }
    }
    all
}

/// A narrow field of view, so that the sheet is at a working distance everywhere in the picture; `level_deg` is the
/// angle of the stripe on a level surface.
fn rig(width: u32, level_deg: f32) -> Optics {
    let (sin, cos) = level_deg.to_radians().sin_cos();
    let [f, c] = [4.0 * width as f32, 0.5 * width as f32];
    Optics { pinhole: [f, f, c, c, 0.0], normal: [0.8828 * sin, 0.8828 * cos, 0.4694].into(), ..optics(width, width) }
}

/// A straight stripe through the middle of a picture that contains its background on both sides.
fn straight(sigma: f64, angle_deg: f64, bits: u8) -> Scene {
    let (sin, cos) = angle_deg.to_radians().sin_cos();
    let full = f64::from((1u32 << bits) - 1);
    let size = (15.0 * sigma) as u32 + 40;
    let middle = 0.5 * f64::from(size);
    let mut noise = Noise(u64::from(size));
    let shot = drawn(size, size + 3, bits, |x, y| {
        let d = ((f64::from(x) - middle) * sin + (f64::from(y) - middle) * cos) / sigma;
        let light = 0.7 * (-0.5 * d * d).exp();
        let read = 0.008 * noise.normal() + (0.0003 * light).sqrt() * noise.normal();
        (full * (0.04 + light + read)).round().clamp(0.0, full) as u32
    });
    let window = ((24.0 * sigma) as u32 | 1).clamp(31, 101);
    Scene {
        name: "",
        shots: vec![shot],
        params: ThresholdParams { size: window, offset: 8 << (bits - 8), minimum: 0, ..Default::default() },
        thinning: Thinning::ZhangSuen,
        flags: 0,
        spacing: 0,
        ambient: None,
    }
}

fn cases(name: &str, scene: &Scene, told: &Told, methods: &[Method], wanted: &str) -> Vec<Case> {
    let mut walk = Walk::new(scene);
    walk.run("");
    let (f, bits) = (walk.frame, scene.shots[0].bits);
    let mut cases = Vec::new();
    for &method in methods {
        // The speckle of wide stripes has grains.
        let grain = if told.width_px > 3.0 { 2.5 } else { 1.0 };
        let p = PeakParams { method, width_px: told.width_px, speckle: 0.05, grain, ..Default::default() };
        let choice = crate::stages::stripe::choose_params::ChooseParams { echo: 0.4, ..Default::default() };
        let frame = peak::PeakFrame::new((f.width, f.height, bits), f.shots, &p, &choice, told.optics.across());
        let quads = f64::from(frame.quads());
        let header = walk.buffers["header"].clone();
        let n = header[listing::COUNT] as usize;
        let groups = [(n as u32).div_ceil(64).max(1), 1, 1];
        let frame_words = bytemuck::cast_slice::<peak::PeakFrame, u32>(&[frame]).to_vec();
        let mut step = |stage: &crate::gpu::Stage,
                        twin: fn(&mut [Vec<u32>], &[(&'static str, f64)]),
                        bindings: &mut Vec<Vec<u32>>,
                        groups: [u32; 3]| {
            let all = [
                (frame::PX_LOG2, f64::from(px_log2(bits))),
                (peak::METHOD, method.number()),
                (peak::QUADS, quads),
                (point::FULL_LENS, told.optics.full_lens()),
            ];
            let overrides: Vec<_> = all.into_iter().filter(|o| stage.overrides.contains(&o.0)).collect();
            if stage.name == wanted {
                let name = format!("{name}, {method:?}");
                cases.push(Case { name, overrides: overrides.clone(), bindings: bindings.clone(), groups });
            }
            twin(bindings, &overrides);
        };
        let (image, points) = (walk.buffers["image"].clone(), walk.buffers["pixels"][..2 * n.max(1)].to_vec());
        let mut b = vec![frame_words.clone(), vec![7; frame.entries as usize]];
        step(&choose::LINES, choose::lines_twin, &mut b, choose::lines_groups(&frame));
        let lines = b.pop().expect("the lines");
        let mut b = vec![frame_words, image, header.clone(), points, vec![0; 12 * n.max(1)], lines];
        step(&peak::STAGE, peak::stage_twin, &mut b, groups);
        let (strongest, peaks) = (b.pop().expect("the strongest"), b.pop().expect("the peaks"));
        let rig = PointFrame::new(&told.optics, &choose::Lines::new(&frame, &choice));
        let poses = (0..f.shots).flat_map(|i| pose(i).map(f32::to_bits)).collect();
        let words = bytemuck::cast_slice::<PointFrame, u32>(&[rig]).to_vec();
        let mut b = vec![words, header, poses, strongest, peaks, vec![0; 4 * n.max(1)]];
        step(&point::STAGE, point::stage_twin, &mut b, groups);
    }
    cases
}
