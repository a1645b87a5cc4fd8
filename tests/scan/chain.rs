//! In: random and adversarial pictures in batches. Out: the pruned chain, the plain chain and the plain
//! definition give the same masks and the same points. Frame and unit: pixels.

use crate::common;
use sheetlight::camera::Intrinsics;
use sheetlight::geometry::{Base, Camera, Plane, Rigid, Vec2, Vec3};
use sheetlight::gpu::Device;
use sheetlight::raster::{Image, Mask};
use sheetlight::stages::cases::{self, drawn, stripe};
use sheetlight::stages::chain::batches::{Batch, Chain};
use sheetlight::stages::chain::config::ChainConfig;
use sheetlight::stages::chain::measure::Measure;
use sheetlight::stages::noise::Noise;
use sheetlight::stages::peak::params::Method;
use sheetlight::stages::peak::params::PeakParams;
use sheetlight::stages::stripe::choose_params::ChooseParams;
use sheetlight::stages::stripe::point::pose_words;
use sheetlight::stages::stripe::{skeleton, thin, threshold};
use sheetlight::stages::{Thinning, ThresholdParams, Window, frame};

fn expected(image: &Image, c: &ChainConfig) -> (Mask, Vec<u32>) {
    let mut lit = threshold::twin(image, &c.threshold);
    if let Some(region) = &c.region {
        lit.intersect(region);
    }
    let thinned = thin::twin(&lit, c.thinning);
    let list = skeleton::twin(&thinned);
    (thinned, list)
}

/// Sends all pictures through, several batches in flight, and compares every one.
fn check(device: &Device, name: &str, config: &ChainConfig, images: &[Image]) -> u32 {
    let mut chain = Chain::new(device, config).unwrap();
    let batches: Vec<&[Image]> = images.chunks(config.shots as usize).collect();
    let (mut next, mut done, mut listed) = (0, 0, 0);
    while done < batches.len() {
        while next < batches.len() && chain.has_room() {
            chain.submit(next as u64, &batches[next].iter().collect::<Vec<_>>()).unwrap();
            next += 1;
        }
        let batch = chain.collect(true).unwrap().unwrap();
        assert_eq!(batch.tag, done as u64, "{name}: order");
        listed += batch.listed_tiles;
        for (i, image) in batches[done].iter().enumerate() {
            let (_, list) = expected(image, config);
            assert!(batch.pixels_of(i).eq(list.iter().copied()), "{name}, batch {done}, shot {i}: points");
        }
        done += 1;
    }
    let last = batches[done - 1];
    chain.submit(0, &last.iter().collect::<Vec<_>>()).unwrap();
    chain.collect(true).unwrap();
    for (i, image) in last.iter().enumerate() {
        assert!(chain.mask(i as u32).unwrap() == expected(image, config).0, "{name}: last mask, shot {i}");
    }
    listed
}

#[test]
fn pruned_plain_and_definition_agree() {
    let Some(device) = common::device() else { return };
    for scene in cases::scenes() {
        if scene.ambient.is_some() {
            continue;
        }
        let first = &scene.shots[0];
        let mut config = ChainConfig::new(first.width, first.height, first.bits);
        config.shots = scene.shots.len() as u32;
        config.threshold = scene.params;
        config.thinning = scene.thinning;
        if scene.flags & frame::HAS_ROI != 0 {
            config.region = Some(Mask::from_fn(first.width, first.height, |x, y| x % 50 > 9 && y > 20));
        }
        // The same pictures twice, so that what the first batch left behind would show in the second.
        let images: Vec<Image> = scene.shots.iter().chain(&scene.shots).cloned().collect();
        let pruned = check(&device, scene.name, &config, &images);
        config.prune = false;
        let plain = check(&device, scene.name, &config, &images);
        assert!(pruned <= plain, "{}", scene.name);
    }
}

/// The paper's points, which `make bench-peers` compares with OpenCV's: the truth is the lens and the plane in f64.
#[test]
fn without_a_fit_every_skeleton_pixel_gives_the_point_of_its_middle() {
    let Some(device) = common::device() else { return };
    for bits in [8, 12] {
        let (width, height) = (641, 479);
        let images = [3, 4].map(|seed| stripe(width, height, bits, 2.5, 3, seed));
        let optics = cases::optics(width, height);
        let measure = Measure {
            peak: PeakParams { method: Method::Pixel, width_px: 2.5, ..PeakParams::default() },
            choose: ChooseParams::lenient(),
            optics,
        };
        let mut config = ChainConfig { shots: 2, measure: Some(measure), ..ChainConfig::new(width, height, bits) };
        config.threshold.offset <<= bits - 8;
        config.threshold.minimum <<= bits - 8;
        let pose: Rigid<Base, Camera> = Rigid::from_vectors(&Vec3::new(0.2, -0.4, 1.1), Vec3::new(40.0, -60.0, 30.0));
        let [fx, fy, cx, cy, skew] = optics.pinhole.map(f64::from);
        let distortion = sheetlight::camera::Distortion::from_opencv(&optics.distortion.map(f64::from)).unwrap();
        let camera = Intrinsics { fx, fy, cx, cy, skew, distortion, width, height };
        let plane = Plane::new(Vec3::from(optics.normal.as_dvec3().to_array()), f64::from(optics.offset)).unwrap();
        let mut chain = Chain::new(&device, &config).unwrap();
        let mut batch = Batch::default();
        chain.submit_posed(0, &[&images[0], &images[1]], &[pose_words(&pose); 2]).unwrap();
        assert!(chain.collect_into(true, &mut batch).unwrap());
        for (i, image) in images.iter().enumerate() {
            let part = batch.starts[i] as usize..batch.starts[i + 1] as usize;
            let (peaks, spots) = (&batch.peaks[part.clone()], &batch.points[part]);
            let pixels: Vec<u32> = peaks.iter().map(|k| k.pixel).collect();
            assert!(pixels.len() > 600 && pixels == expected(image, &config).1, "{bits} bits, shot {i}: pixels");
            for (k, p) in peaks.iter().zip(spots) {
                let (x, y) = (f64::from(k.pixel & 0xffff), f64::from(k.pixel >> 16));
                assert!(k.kept() && (k.u, k.v) == (x as f32, y as f32), "{k:?}");
                let exact = camera.ray_from_pixel(&Vec2::new(x, y)).unwrap().meet(&plane).unwrap();
                let off = (Vec3::from(p.position.as_dvec3().to_array()) - pose.point(&exact)).norm() * fx / exact.z;
                assert!(off < 1e-3, "pixel {x}, {y}: {off} px");
                // An even distribution over the pixel's own height, seen along the plane.
                assert!((k.sigma_px - 1.0 / 12f32.sqrt()).abs() < 1e-6 && p.sigma_mm > 0.0, "{k:?} {p:?}");
            }
        }
    }
}

#[test]
fn one_stripe_lists_few_tiles() {
    let Some(device) = common::device() else { return };
    let mut config = ChainConfig::new(1280, 960, 8);
    config.shots = 1;
    // Four sigmas above the background noise, as OpenCV defines it.
    config.threshold = ThresholdParams { size: 31, offset: 8, minimum: 0, ..Default::default() };
    let image = stripe(1280, 960, 8, 2.5, 2, 9);
    let listed = check(&device, "one stripe", &config, &[image]);
    let tiles = 40 * 120;
    assert!(listed * 10 < tiles, "{listed} of {tiles} tiles listed: the proof of darkness has become weak");
}

#[test]
fn random_pictures_and_settings() {
    let Some(device) = common::device() else { return };
    let mut noise = Noise(2024);
    for round in 0..24 {
        let (w, h) = (1 + noise.next() % 150, 1 + noise.next() % 90);
        let bits = [8, 8, 10, 12, 16][noise.next() as usize % 5];
        let full = (1u32 << bits) - 1;
        let mut config = ChainConfig::new(w, h, bits);
        config.shots = 1 + noise.next() % 3;
        config.thinning = if noise.next().is_multiple_of(2) { Thinning::ZhangSuen } else { Thinning::GuoHall };
        let size = 3 + 2 * (noise.next() % 50);
        let offset = (noise.next() % (full / 4 + 2)) as i32 - (full / 16) as i32;
        let minimum = (noise.next() % 3 * (full / 5)) as u16;
        config.threshold = ThresholdParams { window: Window::Mean, size, offset, minimum };
        let images: Vec<Image> = (0..5)
            .map(|_| {
                let (kind, level, cell) = (noise.next() % 4, noise.next() % (full + 1), 1 + noise.next() % 12);
                let mut grain = Noise(u64::from(noise.next()));
                drawn(w, h, bits, |x, y| match kind {
                    0 => grain.next() % (full + 1),
                    1 => full * u32::from((x / cell + y / cell) % 2 == 0),
                    2 => level.saturating_sub(grain.next() % (full / 8)).max(full * u32::from(x % 40 == y % 40)),
                    _ => (level + x * full / w.max(1)) % (full + 1),
                })
            })
            .collect();
        check(&device, &format!("round {round}: {w} x {h}, {bits} bits, {:?}", config.threshold), &config, &images);
    }
}

#[test]
fn stripes_of_any_width_end_as_lines() {
    let Some(device) = common::device() else { return };
    let mut config = ChainConfig::new(400, 300, 8);
    config.shots = 1;
    config.threshold = ThresholdParams { size: 3, offset: -1, ..Default::default() };
    // With offset -1 everything is lit; the region cuts a blob 200 px high out of it.
    config.region = Some(Mask::from_fn(400, 300, |x, y| (40..360).contains(&x) && (50..250).contains(&y)));
    let flat = drawn(400, 300, 8, |_, _| 90);
    for rule in [Thinning::ZhangSuen, Thinning::GuoHall] {
        config.thinning = rule;
        check(&device, &format!("{rule:?}"), &config, &[flat.clone(), flat.clone(), flat.clone(), flat.clone()]);
    }
}

/// A chain gives later batches only as many sub-iterations as earlier ones needed: wider stripes must start over,
/// also while narrow ones are under way, and beyond what one round holds.
#[test]
fn wider_stripes_after_narrow_ones_are_thinned_to_lines() {
    let Some(device) = common::device() else { return };
    let mut config = ChainConfig::new(200, 160, 8);
    config.shots = 1;
    config.threshold = ThresholdParams { size: 101, offset: 4, ..Default::default() };
    let bar = |width: u32| {
        drawn(200, 160, 8, |x, y| if (20..180).contains(&x) && (40..40 + width).contains(&y) { 200 } else { 10 })
    };
    let images = [3, 3, 3, 3, 24, 3, 64, 3, 12, 3].map(bar);
    for rule in [Thinning::ZhangSuen, Thinning::GuoHall] {
        config.thinning = rule;
        check(&device, &format!("{rule:?}"), &config, &images);
    }
}

#[test]
fn ambient_light_is_subtracted() {
    let Some(device) = common::device() else { return };
    let ambient = drawn(200, 120, 8, |x, y| if (60..100).contains(&x) && y > 70 { 130 } else { 12 });
    let image = stripe(200, 120, 8, 2.0, 0, 4);
    let sum = drawn(200, 120, 8, |x, y| (u32::from(image.get(x, y)) + u32::from(ambient.get(x, y))).min(255));
    let mut config = ChainConfig::new(200, 120, 8);
    config.shots = 1;
    let clean = drawn(200, 120, 8, |x, y| {
        let (v, a) = (u32::from(sum.get(x, y)), u32::from(ambient.get(x, y)));
        if v == 255 { v } else { v.saturating_sub(a) }
    });
    let (_, list) = expected(&clean, &config);
    config.ambient = Some(ambient);
    let mut chain = Chain::new(&device, &config).unwrap();
    chain.submit(0, &[&sum]).unwrap();
    assert!(chain.collect(true).unwrap().unwrap().pixels_of(0).eq(list));
}

#[test]
fn ambient_light_is_subtracted_once_however_often_a_batch_starts_over() {
    let Some(device) = common::device() else { return };
    let mut config = ChainConfig::new(400, 300, 8);
    config.shots = 1;
    // Subtracted twice, the picture falls below the minimum.
    config.threshold = ThresholdParams { size: 3, offset: -1, minimum: 80, ..Default::default() };
    config.region = Some(Mask::from_fn(400, 300, |x, y| (40..360).contains(&x) && (50..250).contains(&y)));
    let (_, list) = expected(&drawn(400, 300, 8, |_, _| 90), &config);
    config.ambient = Some(drawn(400, 300, 8, |_, _| 40));
    let mut chain = Chain::new(&device, &config).unwrap();
    for n in 0..3 {
        chain.submit(n, &[&drawn(400, 300, 8, |_, _| 130)]).unwrap();
    }
    for _ in 0..3 {
        assert!(chain.collect(true).unwrap().unwrap().pixels_of(0).eq(list.iter().copied()));
    }
}

/// Where memory is not shared, pictures go through staging buffers that several threads fill, and results come back
/// through others that grow with them.
#[test]
fn a_device_with_memory_of_its_own_gives_the_same() {
    let Some(device) = common::device() else { return };
    let device = device.as_discrete();
    let mut config = ChainConfig::new(1270, 960, 8);
    config.shots = 4;
    config.threshold = ThresholdParams { size: 5, offset: 12, minimum: 0, ..Default::default() };
    let images: Vec<Image> = (0..9)
        .map(|n| {
            let mut grain = Noise(n);
            let noisy = |_, _| 90 + grain.next() % 30;
            if n % 2 == 0 { stripe(1270, 960, 8, 2.5, 3, n) } else { drawn(1270, 960, 8, noisy) }
        })
        .collect();
    check(&device, "own memory", &config, &images);
    let mut chain = Chain::new(&device, &ChainConfig { slots: 1, ..config }).unwrap();
    chain.submit(7, &images[..4].iter().collect::<Vec<_>>()).unwrap();
    let first = chain.collect(true).unwrap().unwrap();
    assert!(8 * first.pixels.len() > 1 << 20, "{} points need no larger buffer to come back", first.pixels.len());
    chain.submit_again(7, 4).unwrap();
    assert_eq!(chain.collect(true).unwrap().unwrap(), first, "the same pictures once more");
}

/// What is read back shrinks by halves after a full list, and wgpu copies whole words only: an eighth of this list is
/// none.
#[test]
fn a_device_with_memory_of_its_own_calms_down_after_a_full_list_of_an_odd_size() {
    let Some(device) = common::device() else { return };
    let device = device.as_discrete();
    let (width, height) = (2050, 1711);
    let measure = Measure {
        peak: PeakParams { width_px: 2.5, ..PeakParams::default() },
        choose: ChooseParams::lenient(),
        optics: cases::optics(width, height),
    };
    let config = ChainConfig { shots: 1, slots: 1, measure: Some(measure), ..ChainConfig::new(width, height, 8) };
    let lines = drawn(width, height, 8, |_, y| if y % 16 < 3 { 200 } else { 10 });
    let quiet = drawn(width, height, 8, |_, y| if (800..803).contains(&y) { 200 } else { 10 });
    let pose = pose_words(&Rigid::<Base, Camera>::identity());
    let mut chain = Chain::new(&device, &config).unwrap();
    let mut run = |image: &Image| {
        chain.submit_posed(0, &[image], &[pose]).unwrap();
        chain.collect(true).unwrap().unwrap()
    };
    let before = run(&quiet);
    let full = run(&lines);
    let room = full.peaks.len();
    assert!(full.found as usize > room && room % 2 == 1, "{} found, room for {room}", full.found);
    for _ in 0..8 {
        let again = run(&quiet);
        // By their bytes: a refused peak's point is no number, which equals nothing.
        let bytes = |batch: &Batch| bytemuck::pod_collect_to_vec::<_, u8>(&batch.points);
        assert!(again.peaks == before.peaks && bytes(&again) == bytes(&before), "a quiet picture after a full list");
    }
}

#[test]
fn a_lost_device_ends_in_an_error() {
    let Some(device) = common::device() else { return };
    let image = stripe(64, 48, 8, 2.0, 0, 1);
    let mut config = ChainConfig::new(64, 48, 8);
    config.shots = 1;
    let mut chain = Chain::new(&device, &config).unwrap();
    chain.submit(0, &[&image]).unwrap();
    assert!(chain.collect(true).unwrap().is_some());
    device.lose();
    let error = chain.submit(1, &[&image]).and_then(|()| chain.collect(true)).unwrap_err();
    assert_eq!(error.kind, sheetlight::fault::Kind::Device);
    assert!(error.what.contains("lost"), "{error}");
}
