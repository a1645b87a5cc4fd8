//! In: the scenes of the stage tests, and random pictures, sizes and settings. Out: whether the chain on this machine's
//! processor gives the masks and skeletons of the plain twins, pixel for pixel, and their peaks and points. Frame and
//! unit: pixels.

use super::*;
use crate::stages::Window;
use crate::stages::cases::{self, drawn, stripe};
use crate::stages::frame::HAS_ROI;
use crate::stages::noise::Noise;
use crate::stages::stripe::lengthen::LengthenParams;
use crate::stages::stripe::{lengthen, point, spacing, thin};

/// The plain path over every pixel: lit pixels, thinned mask, and the list after lengthening and spacing.
fn plain(image: &Image, c: &ChainConfig) -> (Mask, Mask, Vec<u32>) {
    let image = c.ambient.as_ref().map_or(image.clone(), |a| ambient::without(image, a));
    let mut lit = threshold::twin(&image, &c.threshold);
    if let Some(region) = &c.region {
        lit.intersect(region);
    }
    let thinned = thin::twin(&lit, c.thinning);
    let mut long = thinned.clone();
    if c.lengthen != 0 {
        long = lengthen::twin(&image, &lit, &thinned, WIDTH_PX, &LengthenParams::default());
    }
    if c.spacing != 0 {
        long = spacing::twin(&lit, &long, c.spacing);
    }
    let pixels = skeleton::twin(&long);
    (lit, thinned, pixels)
}

/// The stripe's width for lengthening, px.
const WIDTH_PX: f32 = 3.0;

fn same(name: &str, host: &Host, image: &Image, c: &ChainConfig) {
    let (lit, thinned, pixels) = plain(image, c);
    // Run twice: results of the first picture must not appear in the second.
    for turn in 0..2 {
        let masks = host.masks(image).unwrap();
        assert!(masks[0] == lit, "{name}, turn {turn}: lit pixels");
        assert!(masks[1] == thinned, "{name}, turn {turn}: thinned");
        assert!(host.run(0, image, &cases::pose(0)).unwrap().pixels == pixels, "{name}, turn {turn}: skeleton");
    }
}

#[test]
fn masks_and_skeletons_of_the_scenes_are_those_of_the_twins() {
    for scene in cases::scenes() {
        let first = &scene.shots[0];
        let (w, h) = (first.width, first.height);
        let region = Mask::from_fn(w, h, |x, y| x % 32 > 3 && x % 32 < 24 && y % 5 < 3);
        for (prune, ends, apart) in
            [(true, 0, 0), (true, LengthenParams::default().word(WIDTH_PX), 0), (false, 0, scene.spacing)]
        {
            let config = ChainConfig {
                threshold: scene.params,
                thinning: scene.thinning,
                prune,
                region: (scene.flags & HAS_ROI != 0).then(|| region.clone()),
                ambient: scene.ambient.clone(),
                lengthen: ends,
                spacing: apart,
                ..ChainConfig::new(w, h, first.bits)
            };
            let host = Host::new(&config).unwrap();
            for image in &scene.shots {
                same(scene.name, &host, image, &config);
            }
        }
    }
}

/// A picture of one of several kinds: stripes upright and lying, noise of any strength, steps, spots, gradients.
fn any_picture(w: u32, h: u32, bits: u8, random: &mut Noise) -> Image {
    let full = (1u32 << bits) - 1;
    let (kind, sigma, base) = (random.next() % 7, f64::from(1 + random.next() % 40) / 255.0, random.next() % 200);
    let at = random.next();
    let mut noise = Noise(u64::from(random.next()));
    let level = |v: f64| (v * f64::from(full)).round().clamp(0.0, f64::from(full)) as u32;
    match kind {
        0 => stripe(w, h, bits, 1.0 + f64::from(at % 70) / 10.0, at % 5, u64::from(at)),
        1 => drawn(w, h, bits, |_, _| noise.next() % (full + 1)),
        2 => drawn(w, h, bits, |_, _| level(f64::from(base) / 255.0 + sigma * noise.normal())),
        3 => drawn(w, h, bits, |x, y| {
            let d = (f64::from(x) - 0.4 * f64::from(w) - 0.3 * f64::from(y)) / (1.0 + f64::from(at % 5));
            level(0.1 + 0.7 * (-0.5 * d * d).exp() + 0.01 * noise.normal())
        }),
        4 => drawn(
            w,
            h,
            bits,
            |x, y| if (x / (1 + at % 13) + y / (1 + at % 7)).is_multiple_of(3) { full } else { full / 5 },
        ),
        5 => drawn(w, h, bits, |x, y| level(f64::from(x + y) / f64::from(w + h) + 0.02 * noise.normal())),
        _ => drawn(w, h, bits, |x, y| if (x * 7 + y * 13 + at).is_multiple_of(97) { full } else { level(0.1) }),
    }
}

#[test]
fn masks_and_skeletons_of_random_pictures_are_those_of_the_twins() {
    let mut random = Noise(2026);
    let turns = if std::env::var_os("SHEETLIGHT_LONG").is_some() { 20_000 } else { 250 };
    for turn in 0..turns {
        let mut next = |n: u32| random.next() % n;
        let (w, h) = match next(8) {
            0 => (1 + next(4), 1 + next(40)),
            1 => (1 + next(300), 1 + next(3)),
            _ => (1 + next(330), 1 + next(120)),
        };
        let bits = [8, 8, 8, 10, 12, 16][next(6) as usize];
        let p = ThresholdParams {
            window: if next(5) == 0 { Window::Gaussian } else { Window::Mean },
            size: [3, 5, 9, 13, 15, 17, 31, 33, 51, 99, 101][next(11) as usize],
            offset: (next(30) as i32 - 6) << (bits - 8),
            minimum: ([0, 0, 7, 40][next(4) as usize] << (bits - 8)) as u16,
        };
        let (roi, dim, cut) = (next(3) == 0, next(4) == 0, next(50));
        let config = ChainConfig {
            threshold: p,
            thinning: if next(2) == 0 { Thinning::ZhangSuen } else { Thinning::GuoHall },
            region: roi.then(|| Mask::from_fn(w, h, |x, y| x + 2 * y > cut && x % 40 != 7)),
            lengthen: if next(2) == 0 { 0 } else { LengthenParams::default().word(WIDTH_PX) },
            spacing: [0, 0, 2, 3, 7, 2 | 1 << 16, 4 | 1 << 16][next(7) as usize] | (next(2) * spacing::COMPANY),
            ambient: dim.then(|| drawn(w, h, bits, |x, y| ((x * 3 + y * 5) % 60) << (bits - 8))),
            ..ChainConfig::new(w, h, bits)
        };
        let image = any_picture(w, h, bits, &mut random);
        let name = format!("turn {turn}, {w}x{h}, {bits} bits, {p:?}");
        same(&name, &Host::new(&config).unwrap(), &image, &config);
    }
}

/// Rows of a band are computed when they are needed, over those of the previous picture, which must not be used for
/// this one.
#[test]
fn what_a_picture_left_behind_says_nothing_of_the_next() {
    let (w, h) = (320, 700);
    let bright = drawn(w, h, 8, |x, y| 230 + (x * 31 + y * 17) % 9);
    // Bright above and dark below, with an edge every 40 rows and a faint line beneath each. There a window is darkest
    // at its lower end, which is computed last.
    let edges = |shift: u32| {
        drawn(w, h, 8, move |x, y| match (y + shift) % 40 {
            0..20 => 120 + (x * 31 + y * 17) % 3,
            d @ 20..28 => 10 + 14 * (d - 20) + x % 2,
            _ => 10,
        })
    };
    for size in [9, 15, 31, 101] {
        let threshold = ThresholdParams { size, ..ThresholdParams::default() };
        let config = ChainConfig { threshold, ..ChainConfig::new(w, h, 8) };
        let host = Host::new(&config).unwrap();
        for shift in (1..40).step_by(4) {
            same("bright", &host, &bright, &config);
            same(&format!("edges moved by {shift}"), &host, &edges(shift), &config);
        }
    }
}

/// A picture so large that it is divided among threads, with a second stripe in an unexpected place.
#[test]
fn a_second_stripe_anywhere_in_a_large_picture_is_found() {
    let (w, h) = (2048, 1400);
    let config = ChainConfig { lengthen: LengthenParams::default().word(WIDTH_PX), ..ChainConfig::new(w, h, 8) };
    let host = Host::new(&config).unwrap();
    for (x0, y0) in [(0, 0), (1000, 3), (2040, 700), (5, 1392)] {
        let image = drawn(w, h, 8, |x, y| {
            let main = (f64::from(y) - 600.0 - 0.1 * f64::from(x)) / 2.5;
            let second = x >= x0 && x < x0 + 8 && y >= y0 && y < y0 + 6;
            10 + (150.0 * (-0.5 * main * main).exp()) as u32 + if second { 30 } else { 0 } + (x * 31 + y * 17) % 3
        });
        same(&format!("second at {x0}, {y0}"), &host, &image, &config);
        let pixels = host.run(0, &image, &cases::pose(0)).unwrap().pixels;
        let near = |&p: &u32| (p & 0xffff).abs_diff(x0 + 4) < 9 && (p >> 16).abs_diff(y0 + 3) < 9;
        assert!(pixels.iter().any(near), "the second stripe at {x0}, {y0} is lost");
    }
}

#[test]
fn peaks_and_points_are_those_of_the_twins() {
    let image = stripe(640, 360, 8, 2.5, 5, 4);
    let optics = cases::optics(640, 360);
    let peak = peak::PeakParams { width_px: 2.5, ..Default::default() };
    let measure = Measure { peak, choose: crate::stages::stripe::choose_params::ChooseParams::default(), optics };
    let config = ChainConfig { measure: Some(measure), ..ChainConfig::new(640, 360, 8) };
    let found = Host::new(&config).unwrap().run(5, &image, &cases::pose(2)).unwrap();
    let mut peaks = peak::peaks(&image, &plain(&image, &config).2, 5, &peak, optics.across());
    let scene = choose::Scene { width: 640, height: 360, full_scale: 255.0, width_px: 2.5, across: optics.across() };
    choose::choose(&mut peaks, &scene, &crate::stages::stripe::choose_params::ChooseParams::default());
    let points = point::posed(&mut peaks, &optics, &cases::pose(2));
    assert!(peaks.len() > 600 && found.peaks == peaks);
    let bits = |p: &[Point]| bytemuck::cast_slice::<Point, u32>(p).to_vec();
    assert_eq!(bits(&found.points), bits(&points));
}
