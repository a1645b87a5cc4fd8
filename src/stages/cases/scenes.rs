//! In: nothing. Out: the pictures on which the stages are tested, with a rig and poses. Frame and unit: pixels, grey
//! levels; mm.

use crate::camera::{Distortion, Intrinsics};
use crate::geometry::{Plane, Vec3};
use crate::raster::Image;
use crate::stages::noise::Noise;
use crate::stages::stripe::{point, spacing};
use crate::stages::{Thinning, ThresholdParams, Window, frame};

/// Pictures of one batch with their settings.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Description of the pictures, for the cases' names.
    pub name: &'static str,
    /// The pictures, all of one size and depth.
    pub shots: Vec<Image>,
    /// Settings of the threshold: px, and grey levels of the pictures' depth.
    pub params: ThresholdParams,
    /// The rule of thinning.
    pub thinning: Thinning,
    /// Bits to set in [`frame::Frame::flags`] in addition to those of the settings.
    pub flags: u32,
    /// Value of [`frame::Frame::spacing`].
    pub spacing: u32,
    /// Picture of the ambient light, of the same size and depth; with `None` nothing is subtracted.
    pub ambient: Option<Image>,
}

/// One curved Gaussian stripe of the given sigma with noise and `blobs` round reflections.
pub fn stripe(width: u32, height: u32, bits: u8, sigma: f64, blobs: u32, seed: u64) -> Image {
    let mut noise = Noise(seed);
    let full = f64::from((1u32 << bits) - 1);
    let spots: Vec<(f64, f64, f64)> = (0..blobs)
        .map(|_| (f64::from(noise.next() % width), f64::from(noise.next() % height), 2.0 + f64::from(noise.next() % 8)))
        .collect();
    let mut px = Vec::with_capacity((width * height) as usize);
    for y in 0..height {
        for x in 0..width {
            let t = f64::from(x) / f64::from(width);
            let centre =
                f64::from(height) * (0.5 + 0.2 * (5.0 * t + seed as f64).sin() + if t > 0.6 { 0.1 } else { 0.0 });
            let d = (f64::from(y) - centre) / sigma;
            let mut v = 0.7 * (-0.5 * d * d).exp();
            for &(bx, by, r) in &spots {
                let d2 = ((f64::from(x) - bx).powi(2) + (f64::from(y) - by).powi(2)) / (r * r);
                if d2 < 9.0 {
                    v += 0.9 * (-0.5 * d2).exp();
                }
            }
            let read = 0.008 * noise.normal() + (0.0003 * v.max(0.0)).sqrt() * noise.normal();
            px.push((full * (0.04 + v + read)).round().clamp(0.0, full) as u16);
        }
    }
    image(width, height, bits, px)
}

/// A picture from a function of the pixel.
pub fn drawn(width: u32, height: u32, bits: u8, mut f: impl FnMut(u32, u32) -> u32) -> Image {
    let px = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| f(x, y) as u16).collect();
    image(width, height, bits, px)
}

/// Faint noise with one brighter pixel in every other tile of every other row of tiles, at the picture's border if the
/// tile touches it; some tiles have two. Each pixel is as bright as the threshold or one level above or below it.
fn specks(width: u32, height: u32, bits: u8) -> Image {
    let mut noise = Noise(31);
    let grey = |level: u32| level << (bits - 8);
    drawn(width, height, bits, |x, y| {
        let (tx, ty) = (x / 32, y / 8);
        let at = |n: u32, first: u32, size: u32, last: u32| (first + n % size).min(last - 1);
        let place = |k: u32| (at(tx * 13 + ty * 5 + k, 32 * tx, 32, width), at(tx * 3 + ty * 7 + k, 8 * ty, 8, height));
        let spot = (tx + ty) % 2 == 0 && ((x, y) == place(0) || tx % 3 == 0 && (x, y) == place(1));
        let border = [(0, 0), (width - 1, 0), (0, height - 1), (width - 1, height - 1)].contains(&(x, y));
        let background = grey(10) + noise.next() % grey(2);
        if spot || border { background + grey(8) + tx % 3 * grey(1) / 2 } else { background }
    })
}

fn image(width: u32, height: u32, bits: u8, px: Vec<u16>) -> Image {
    if bits == 8 {
        Image::from_u8(width, height, px.iter().map(|&v| v as u8).collect())
    } else {
        Image::from_u16(width, height, bits, px)
    }
}

/// The pictures of the stage tests: real shapes, odd sizes, several depths, and adversarial pictures.
pub fn scenes() -> Vec<Scene> {
    let base = Scene {
        name: "",
        shots: Vec::new(),
        params: ThresholdParams::default(),
        thinning: Thinning::ZhangSuen,
        flags: 0,
        spacing: 0,
        ambient: None,
    };
    let p = |size, offset, minimum| ThresholdParams { size, offset, minimum, ..Default::default() };
    let mut noise = Noise(7);
    let mut grain = Noise(99);
    vec![
        Scene {
            name: "two stripes of 641 x 479",
            shots: vec![stripe(641, 479, 8, 2.5, 3, 1), stripe(641, 479, 8, 4.0, 0, 2)],
            spacing: 3,
            ..base.clone()
        },
        Scene {
            name: "12 bits, Guo-Hall, ambient",
            shots: vec![stripe(203, 150, 12, 3.0, 2, 3)],
            params: p(25, 120, 300),
            thinning: Thinning::GuoHall,
            spacing: 2 | 1 << 16,
            ambient: Some(drawn(203, 150, 12, |x, y| (x * 7 + y * 13) % 160)),
            ..base.clone()
        },
        Scene {
            name: "16 bits, saturated, window 101",
            shots: vec![drawn(130, 90, 16, |x, y| if (x / 9 + y / 5) % 3 == 0 { 65535 } else { 40000 + x * 50 })],
            params: p(101, 500, 0),
            ..base.clone()
        },
        Scene {
            name: "noise, every tile",
            shots: vec![drawn(97, 69, 8, |_, _| noise.next() % 256)],
            spacing: 2 | spacing::COMPANY,
            params: p(3, 0, 0),
            flags: frame::ALL_TILES,
            ..base.clone()
        },
        Scene {
            name: "checkers",
            shots: vec![drawn(160, 64, 8, |x, y| if (x + y) % 2 == 0 { 200 } else { 10 })],
            params: p(5, -3, 0),
            ..base.clone()
        },
        Scene {
            name: "all bright, negative offset",
            shots: vec![drawn(64, 40, 8, |_, _| 255)],
            params: p(11, -1, 0),
            ..base.clone()
        },
        Scene {
            name: "stripes on tile borders, region of interest",
            shots: vec![drawn(256, 128, 8, |x, y| if x % 32 < 2 || y % 8 == 7 { 220 } else { 20 })],
            spacing: 5,
            params: p(31, 20, 40),
            flags: frame::HAS_ROI,
            ..base.clone()
        },
        Scene {
            name: "specks at all borders",
            shots: vec![specks(229, 122, 8), specks(229, 122, 8)],
            spacing: spacing::COMPANY,
            params: p(31, 8, 0),
            ..base.clone()
        },
        Scene {
            name: "deep specks, window 9, region of interest",
            shots: vec![specks(170, 99, 12)],
            spacing: 3 | 1 << 16 | spacing::COMPANY,
            params: p(9, 124, 160),
            flags: frame::HAS_ROI,
            ..base.clone()
        },
        Scene {
            // 9 (25 - 4) equals 9 * 20 + 5 + 4: with one level more the pixel would pass.
            name: "specks that just do not pass",
            shots: vec![drawn(96, 40, 8, |x, y| if x % 64 == 17 && y % 16 == 3 { 25 + y / 32 } else { 20 })],
            params: p(3, 4, 0),
            ..base.clone()
        },
        Scene {
            name: "Gaussian window",
            shots: vec![stripe(320, 200, 8, 3.0, 2, 5)],
            params: ThresholdParams { window: Window::Gaussian, size: 31, offset: 6, minimum: 0 },
            ..base.clone()
        },
        Scene {
            name: "Gaussian window of 7 on deep noise",
            shots: vec![drawn(70, 50, 10, |_, _| grain.next() % 1024)],
            params: ThresholdParams { window: Window::Gaussian, size: 7, offset: 20, minimum: 30 },
            ..base.clone()
        },
        Scene { name: "one pixel", shots: vec![drawn(1, 1, 8, |_, _| 9)], params: p(3, -1, 0), ..base },
    ]
}

/// A camera with a 55 degree field of view and a common lens, and a sheet that crosses its axis at 155 mm.
pub fn optics(width: u32, height: u32) -> point::Optics {
    let f = 0.96 * width as f32;
    point::Optics {
        pinhole: [f, f, 0.49 * width as f32, 0.51 * height as f32, 0.0],
        distortion: [-0.118, 0.086, 0.00062, -0.00041, -0.017, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        untilt: point::FLAT,
        normal: glam::Vec3::from_array([-0.0192, 0.8828, 0.4694]),
        offset: 72.15,
    }
}

/// The same with all lens terms and a sensor tilted by 11 and 7 degrees.
pub(super) fn tilted(width: u32, height: u32) -> point::Optics {
    let k = Intrinsics {
        fx: 0.96 * f64::from(width),
        fy: 0.97 * f64::from(width),
        cx: 0.49 * f64::from(width),
        cy: 0.51 * f64::from(height),
        skew: 0.4,
        distortion: Distortion([0.3, -0.1, 6e-4, -4e-4, 0.01, 0.5, 0.04, 0.02, 2e-3, -1e-3, -2e-3, 1e-3, 0.19, -0.12]),
        width,
        height,
    };
    point::Optics::new(&k, &Plane::new(Vec3::new(-0.0192, 0.8828, 0.4694), 72.15).expect("a normal"))
}

/// A rotated pose some distance from the base, different for each shot.
pub fn pose(shot: u32) -> [f32; 12] {
    let (s, c) = (0.3 + 0.1 * shot as f32).sin_cos();
    [c, -s, 0.0, 420.0, s, c, 0.0, -60.0 + shot as f32, 0.0, 0.0, 1.0, 310.0]
}
