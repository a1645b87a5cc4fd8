//! In: a number from 0 to 1. Out: a colour whose lightness grows evenly with it, so that the eye orders heights
//! correctly and grey prints stay readable.
//! Frame and unit: sRGB.

use super::Rgb;
use glam::Vec3;

/// Dark violet over teal to yellow (the viridis map, sampled at nine places); clamped to 0..=1.
pub fn ordered(x: f32) -> Rgb {
    const STOPS: [Vec3; 9] = [
        Vec3::new(68.0, 1.0, 84.0),
        Vec3::new(71.0, 44.0, 122.0),
        Vec3::new(59.0, 81.0, 139.0),
        Vec3::new(44.0, 113.0, 142.0),
        Vec3::new(33.0, 144.0, 141.0),
        Vec3::new(39.0, 173.0, 129.0),
        Vec3::new(92.0, 200.0, 99.0),
        Vec3::new(170.0, 220.0, 50.0),
        Vec3::new(253.0, 231.0, 37.0),
    ];
    let at = x.clamp(0.0, 1.0) * (STOPS.len() - 1) as f32;
    let i = (at as usize).min(STOPS.len() - 2);
    let f = at - i as f32;
    (STOPS[i] + f * (STOPS[i + 1] - STOPS[i])).round().to_array().map(|v| v as u8)
}

/// Black to white.
pub fn grey(x: f32) -> Rgb {
    [(x.clamp(0.0, 1.0) * 255.0).round() as u8; 3]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lightness_grows_all_the_way() {
        let light = |x: f32| {
            let [r, g, b] = ordered(x).map(f32::from);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        for i in 0..100 {
            assert!(light((i + 1) as f32 / 100.0) > light(i as f32 / 100.0) - 0.5, "{i}");
        }
        assert!(light(1.0) > light(0.0) + 150.0);
    }
}
