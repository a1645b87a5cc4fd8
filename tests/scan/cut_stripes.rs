//! Stripes that fall over the edge of a surface or of a print: what the cut does to the centres beside it must not
//! depend on how the stripe lies in the picture. Pixels, grey levels of 8 bits.

use sheetlight::raster::Image;
use sheetlight::stages::noise::Noise;
use sheetlight::stages::peak::params::PeakParams;
use sheetlight::stages::peak::{Peak, peaks};

/// Side of a picture; its stripe passes within half a pixel of the middle.
const SIDE: i32 = 61;
/// Pictures of one stripe and cut, each with a sub-pixel place of both of its own.
const PICTURES: usize = 40;
/// Places along the stripe from the cut whose centres are judged, px; the stripe is dark on the positive side.
const PLACES: std::ops::RangeInclusive<i32> = -7..=3;
/// Points of light a pixel is the mean of, along each axis.
const FINE: i32 = 6;
/// Sigma of the lens's blur of an edge, px.
const BLUR: f64 = 0.55;
const LIGHT: f64 = 150.0;
const DARK: f64 = 3.0;

/// Angles to the image's axes: of the normal of the stripe from the columns' way down, and of the normal of the cut
/// from the rows' way right; degrees.
#[derive(Clone, Copy)]
struct Lie {
    stripe: f64,
    cut: f64,
}

impl Lie {
    /// Root mean square error of the centres across the stripe; beyond the cut the surface gives `left` of the light.
    fn error(self, sigma: f64, left: f64) -> f64 {
        let ((nx, ny), (cy, cx)) = (self.stripe.to_radians().sin_cos(), self.cut.to_radians().sin_cos());
        let params = PeakParams {
            width_px: (sigma * sigma + 1.0 / 12.0f64).sqrt() as f32,
            speckle: 0.1,
            read_noise: 0.5,
            gain: 0.0,
            ..PeakParams::default()
        };
        let mut noise = Noise(3);
        let mut random = || f64::from(noise.next() % 1000) / 1000.0 - 0.5;
        let (mut squares, mut count) = (0.0, 0);
        for _ in 0..PICTURES {
            let (middle, edge) = (random(), random());
            let across = |x: f64, y: f64| x * nx + y * ny - middle;
            let beyond = |x: f64, y: f64| x * cx + y * cy - edge;
            let light = |x: f64, y: f64| {
                // Within 2 % a blurred edge.
                let lit = left + (1.0 - left) * 0.5 * (1.0 - (0.8 * beyond(x, y) / BLUR).tanh());
                lit * (-0.5 * (across(x, y) / sigma).powi(2)).exp()
            };
            let at = |i: i32| f64::from(i - SIDE / 2);
            let part = |k: i32| (f64::from(k) + 0.5) / f64::from(FINE) - 0.5;
            let level = |i: i32| {
                let (x, y) = (at(i % SIDE), at(i / SIDE));
                let parts = (0..FINE * FINE).map(|k| light(x + part(k % FINE), y + part(k / FINE)));
                DARK + LIGHT * parts.sum::<f64>() / f64::from(FINE * FINE)
            };
            let pixels = (0..SIDE * SIDE).map(|i| level(i).round() as u8).collect();
            let image = Image::from_u8(SIDE as u32, SIDE as u32, pixels);
            let skeleton: Vec<u32> = PLACES
                .map(|t| {
                    let (x, y) = (middle * nx + f64::from(t) * ny, middle * ny - f64::from(t) * nx);
                    let pixel = |v: f64| (v.round() as i32 + SIDE / 2) as u32;
                    pixel(x) | pixel(y) << 16
                })
                .collect();
            let found = peaks(&image, &skeleton, 0, &params, glam::Vec2::new(nx as f32, ny as f32));
            let error = |k: &Peak| across(f64::from(k.u) - f64::from(SIDE / 2), f64::from(k.v) - f64::from(SIDE / 2));
            squares += found.iter().map(|k| error(k).powi(2)).sum::<f64>();
            count += found.len();
        }
        (squares / count as f64).sqrt()
    }
}

/// A print's rim that crosses a slanted stripe at 30 to 60 degrees moves its centres as it moves those of a lying
/// stripe that it crosses at the same angle. Windows of columns, and directions that the rim turns, moved them by up
/// to twice as much.
#[test]
fn a_cut_moves_a_slanted_stripe_as_it_moves_a_lying_one() {
    let mut faults = Vec::new();
    for sigma in [0.7, 1.5] {
        for stripe in [30.0, 38.0, 45.0, 52.0, 60.0] {
            for (axis, crossed) in [(0.0, stripe), (90.0, 90.0 - stripe)] {
                let lying = Lie { stripe: 0.0, cut: crossed }.error(sigma, 0.15);
                let slanted = Lie { stripe, cut: axis }.error(sigma, 0.15);
                let line = format!(
                    "{sigma} px at {stripe}, cut along {axis} degrees: {slanted:.3} px, lying {lying:.3}, ratio {:.2}",
                    slanted / lying
                );
                println!("{line}");
                if !(0.8..1.4).contains(&(slanted / lying)) {
                    faults.push(line);
                }
            }
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
}

/// The direction across a stripe, without noise, is right at every angle and width, whatever the rig's stripe.
#[test]
fn the_direction_of_a_narrow_stripe_is_right_at_every_angle() {
    let mut worst: (f64, String) = (0.0, String::new());
    for sigma in [0.6, 0.7, 0.8, 1.0, 1.5] {
        for rig in [0.0f64, 45.0, 90.0] {
            for angle in (0..=90).step_by(3).map(f64::from).filter(|a| (a - rig).abs() <= 60.0) {
                let (nx, ny) = angle.to_radians().sin_cos();
                let middle = SIDE / 2;
                let level = |i: i32| {
                    let (x, y) = (f64::from(i % SIDE - middle), f64::from(i / SIDE - middle));
                    let part = |k: i32| (f64::from(k) + 0.5) / f64::from(FINE) - 0.5;
                    let light = |k: i32| {
                        let d = (x + part(k % FINE)) * nx + (y + part(k / FINE)) * ny - 0.1;
                        (-0.5 * (d / sigma).powi(2)).exp()
                    };
                    (DARK + LIGHT * (0..FINE * FINE).map(light).sum::<f64>() / f64::from(FINE * FINE)).round() as u8
                };
                let image = Image::from_u8(SIDE as u32, SIDE as u32, (0..SIDE * SIDE).map(level).collect());
                let params =
                    PeakParams { width_px: (sigma * sigma + 1.0 / 12.0f64).sqrt() as f32, ..PeakParams::default() };
                let (sin, cos) = rig.to_radians().sin_cos();
                let across = glam::Vec2::new(sin as f32, cos as f32);
                let seen = &peaks(&image, &[(middle | middle << 16) as u32], 0, &params, across)[0];
                let seen_deg = f64::from(seen.normal_u).atan2(f64::from(seen.normal_v)).to_degrees();
                let off = ((seen_deg - angle + 90.0).rem_euclid(180.0) - 90.0).abs();
                if off > worst.0 {
                    worst = (off, format!("{sigma} px at {angle} degrees, the rig's at {rig}: seen at {seen_deg:.1}"));
                }
            }
        }
    }
    println!("worst: {} degrees off: {}", worst.0, worst.1);
    assert!(worst.0 < 7.0, "{} degrees off: {}", worst.0, worst.1);
}
