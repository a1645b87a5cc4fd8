//! In: pictures with their masks by cv2.adaptiveThreshold and skeletons by cv2.ximgproc.thinning (tests/golden/masks,
//! made by the script there). Out: twins and GPU chain give the same: the mean window and thinning pixel for pixel, the
//! Gaussian window but for 1 pixel in 100,000. Frame and unit: pixels.

use crate::common;
use sheetlight::raster::{Channel, Image, Mask, load};
use sheetlight::stages::chain::batches::Chain;
use sheetlight::stages::chain::config::ChainConfig;
use sheetlight::stages::stripe::{thin, threshold};
use sheetlight::stages::{Thinning, ThresholdParams, Window};
use std::path::{Path, PathBuf};

#[derive(serde::Deserialize)]
struct List {
    pictures: Vec<Picture>,
}

#[derive(serde::Deserialize)]
struct Picture {
    name: String,
    masks: Vec<Threshold>,
    skeletons: Vec<Skeleton>,
}

#[derive(serde::Deserialize)]
struct Threshold {
    window: Window,
    size: u32,
    offset: i32,
}

#[derive(serde::Deserialize)]
struct Skeleton {
    thinning: Thinning,
    /// Place in the list of masks.
    mask: usize,
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/masks")
}

fn list() -> Vec<Picture> {
    let text = std::fs::read_to_string(folder().join("list.json")).unwrap();
    serde_json::from_str::<List>(&text).unwrap().pictures
}

fn picture(p: &Picture) -> Image {
    load(&folder().join(format!("{}_picture.png", p.name)), Channel::Luma, 8).unwrap()
}

/// The masks of a stack, each as high as the picture.
fn stack(p: &Picture, kind: &str, height: u32) -> Vec<Mask> {
    let all = load(&folder().join(format!("{}_{kind}.png", p.name)), Channel::Luma, 8).unwrap();
    (0..all.height / height).map(|i| Mask::from_fn(all.width, height, |x, y| all.get(x, i * height + y) > 0)).collect()
}

fn params(t: &Threshold) -> ThresholdParams {
    ThresholdParams { window: t.window, size: t.size, offset: t.offset, minimum: 0 }
}

fn apart(a: &Mask, b: &Mask) -> u64 {
    assert_eq!((a.width, a.height), (b.width, b.height));
    a.words.iter().zip(&b.words).map(|(a, b)| u64::from((a ^ b).count_ones())).sum()
}

#[test]
fn twins_give_the_masks_and_skeletons_of_opencv() {
    let (mut gaussian, mut differing) = (0, 0);
    for p in list() {
        let image = picture(&p);
        let (masks, skeletons) = (stack(&p, "masks", image.height), stack(&p, "skeletons", image.height));
        assert_eq!((masks.len(), skeletons.len()), (p.masks.len(), p.skeletons.len()), "{}", p.name);
        for (t, mask) in p.masks.iter().zip(&masks) {
            let n = apart(&threshold::twin(&image, &params(t)), mask);
            if t.window == Window::Gaussian {
                gaussian += image.pixel_count() as u64;
                differing += n;
            } else {
                assert_eq!(n, 0, "{}: mean window {} offset {}", p.name, t.size, t.offset);
            }
        }
        for (s, skeleton) in p.skeletons.iter().zip(&skeletons) {
            let n = apart(&thin::twin(&masks[s.mask], s.thinning), skeleton);
            assert_eq!(n, 0, "{}: {:?} of mask {}", p.name, s.thinning, s.mask);
        }
    }
    println!("Gaussian windows: {differing} of {gaussian} pixels differ");
    assert!(gaussian > 1_000_000 && differing * 100_000 <= gaussian, "{differing} of {gaussian} pixels differ");
}

#[test]
fn the_gpu_gives_the_masks_and_skeletons_of_opencv() {
    let Some(device) = common::device() else { return };
    let (mut gaussian, mut differing) = (0, 0);
    for p in list() {
        let image = picture(&p);
        let (masks, skeletons) = (stack(&p, "masks", image.height), stack(&p, "skeletons", image.height));
        let run = |t: &Threshold, thinning: Thinning| {
            let config = ChainConfig {
                threshold: params(t),
                thinning,
                shots: 1,
                slots: 1,
                ..ChainConfig::new(image.width, image.height, 8)
            };
            let mut chain = Chain::new(&device, &config).unwrap();
            chain.submit(0, &[&image]).unwrap();
            chain.collect(true).unwrap().unwrap();
            (chain.lit(0).unwrap(), chain.mask(0).unwrap())
        };
        for (s, skeleton) in p.skeletons.iter().zip(&skeletons) {
            let t = &p.masks[s.mask];
            let (lit, thinned) = run(t, s.thinning);
            assert_eq!(apart(&lit, &masks[s.mask]), 0, "{}: mean window {} offset {}", p.name, t.size, t.offset);
            assert_eq!(apart(&thinned, skeleton), 0, "{}: {:?} of mask {}", p.name, s.thinning, s.mask);
        }
        // Of the Gaussian windows, every third.
        for (t, mask) in p.masks.iter().zip(&masks).filter(|(t, _)| t.window == Window::Gaussian).step_by(3) {
            gaussian += image.pixel_count() as u64;
            differing += apart(&run(t, Thinning::ZhangSuen).0, mask);
        }
    }
    println!("Gaussian windows: {differing} of {gaussian} pixels differ");
    assert!(gaussian > 300_000 && differing * 100_000 <= gaussian, "{differing} of {gaussian} pixels differ");
}

/// Stripes of one to three pixels at every angle and place, as far as they reach: every column (or row, where they
/// stand) that crosses one has a pixel of its skeleton, there or beside it, and hardly more than one, by the rule for
/// its direction. Zhang-Suen's alone loses all of some.
#[test]
fn thinning_loses_no_stripe() {
    const SIZE: u32 = 72;
    const MARGIN: u32 = 6;
    // What a line's own ends may lose.
    const END: u32 = 12;
    let mut most = 0f64;
    for angle_deg in [0.0f64, 10.0, 21.0, 24.0, 30.0, 40.0, 44.0, 45.0, 46.0, 60.0, 90.0, 135.0] {
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        let lying = cos.abs() >= sin.abs() - 1e-9;
        for (width, place) in [1.0, 1.5, 2.0, 2.5, 3.0].into_iter().flat_map(|w| (0..15).map(move |k| (w, k))) {
            let inside = |x: u32| (MARGIN..SIZE - MARGIN).contains(&x);
            let lit = Mask::from_fn(SIZE, SIZE, |x, y| {
                let [x, y] = [x, y].map(|v| f64::from(v) - f64::from(SIZE / 2));
                (x * sin + y * cos - 0.1 * f64::from(place)).abs() <= 0.5 * width
            });
            let lit = Mask::from_fn(SIZE, SIZE, |x, y| inside(x) && inside(y) && lit.get(x, y));
            let thinned = thin::twin(&lit, Thinning::across([sin as f32, cos as f32].into()));
            let crossed = |mask: &Mask, a: u32| {
                (0..SIZE).filter(|&b| if lying { mask.get(a, b) } else { mask.get(b, a) }).count()
            };
            let (mut lines, mut pixels) = (0, 0);
            for a in (END..SIZE - END).filter(|&a| crossed(&lit, a) > 0) {
                let near = (a - 1..=a + 1).map(|a| crossed(&thinned, a)).sum::<usize>();
                assert!(near > 0, "{angle_deg} degrees, {width} px, place {place}: nothing is left of line {a}");
                (lines, pixels) = (lines + 1, pixels + crossed(&thinned, a));
            }
            // Zhang-Suen's leaves the corners of stairs.
            let corners =
                if Thinning::across([sin as f32, cos as f32].into()) == Thinning::ZhangSuen { 0.2 } else { 0.0 };
            most = most.max(pixels as f64 / f64::from(lines) - corners);
        }
    }
    println!("at most {most:.2} pixels a line");
    assert!(most < 1.15, "{most} pixels a line");
}
