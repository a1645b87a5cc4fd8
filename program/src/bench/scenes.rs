//! In: a size and the name of a scene. Out: pictures of the scene, identical on every machine.
//! Frame and unit: pixels, grey levels.

use glam::Vec3Swizzles;
use sheetlight::raster::Image;
use sheetlight::stages::cases::{drawn, optics, stripe};
use sheetlight::stages::noise::Noise;
use sheetlight::stages::stripe::point::Optics;

/// Contents of the pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scene {
    /// One curved stripe, sigma 2.5 px, a few reflections, read and shot noise.
    OneStripe,
    /// The same, sigma 6 px.
    ThickStripe,
    /// As `OneStripe`, seen by a camera that is turned by 90 degrees.
    UprightStripe,
    /// As `ThickStripe`, seen by a camera that is turned by 90 degrees.
    UprightThick,
    /// A stripe in noise so dense that a tenth of all pixels is bright.
    NoiseHeavy,
    /// A stripe and 60 bright spots.
    ReflectionHeavy,
}

impl Scene {
    /// All scenes.
    pub const ALL: [Scene; 6] = [
        Scene::OneStripe,
        Scene::ThickStripe,
        Scene::UprightStripe,
        Scene::UprightThick,
        Scene::NoiseHeavy,
        Scene::ReflectionHeavy,
    ];
    /// Name in tables and messages.
    pub fn name(self) -> &'static str {
        match self {
            Scene::OneStripe => "one stripe",
            Scene::ThickStripe => "thick stripe",
            Scene::UprightStripe => "upright stripe",
            Scene::UprightThick => "upright thick",
            Scene::NoiseHeavy => "noise-heavy",
            Scene::ReflectionHeavy => "reflection-heavy",
        }
    }
    /// Gaussian sigma of the stripe's profile, px.
    pub fn width_px(self) -> f32 {
        if matches!(self, Scene::ThickStripe | Scene::UprightThick) { 6.0 } else { 2.5 }
    }
    /// Optics of the rig that sees the scene.
    pub fn optics(self, width: u32, height: u32) -> Optics {
        let lying = optics(width, height);
        let upright = matches!(self, Scene::UprightStripe | Scene::UprightThick);
        if upright { Optics { normal: lying.normal.yxz(), ..lying } } else { lying }
    }
}

/// `count` different 8-bit pictures of a scene.
pub fn pictures(scene: Scene, width: u32, height: u32, count: u32) -> Vec<Image> {
    (0..u64::from(count))
        .map(|seed| match scene {
            Scene::OneStripe | Scene::ThickStripe => stripe(width, height, 8, scene.width_px().into(), 3, seed),
            Scene::UprightStripe | Scene::UprightThick => {
                let lying = stripe(height, width, 8, scene.width_px().into(), 3, seed);
                drawn(width, height, 8, |x, y| u32::from(lying.get(y, x)))
            }
            Scene::ReflectionHeavy => stripe(width, height, 8, 2.5, 60, seed),
            // About a tenth of the pixels exceeds an offset of 8 levels.
            Scene::NoiseHeavy => noisy(width, height, 7.0, seed),
        })
        .collect()
}

/// A stripe in noise of `sigma` grey levels, 1 sigma.
pub fn noisy(width: u32, height: u32, sigma: f64, seed: u64) -> Image {
    let clean = stripe(width, height, 8, 2.5, 3, seed);
    let mut noise = Noise(seed + 100);
    drawn(width, height, 8, |x, y| {
        (f64::from(clean.get(x, y)) + 20.0 + sigma * noise.normal()).round().clamp(0.0, 255.0) as u32
    })
}
