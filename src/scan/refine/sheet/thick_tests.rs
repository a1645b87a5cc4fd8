//! In: simulated scans of printed surfaces, of a camera that goes on evenly or stands. Out: whether the sheet is found
//! and its effect removed. Where the brightness is even, no point may move.
//! Frame and unit: base frame, mm; rad.

use super::*;
use crate::geometry::{Base, Camera, Plane, Rigid, Vec3, exp};
use crate::scan::Along;
use crate::stages::noise::Noise;

/// A scan by a camera 150 mm above a surface, with a sheet 60 mm beside it.
#[derive(Clone, Copy)]
struct Scene {
    shots: u32,
    along: Along,
    /// Number of steps that the camera has gone at a shot.
    gone: fn(u32) -> f64,
    /// Distance from shot to shot, mm, and rotation of camera and sheet about the vertical, rad.
    step: f64,
    turn: f64,
    /// Standard deviation of the sheet, mm.
    thick: f64,
    height: fn(f64, f64) -> f64,
    albedo: fn(f64, f64) -> f64,
    /// Scatter of the light from point to point, and of the laser from shot to shot, as logarithms.
    speckle: f64,
    flicker: f64,
    focal_px: f64,
}

/// Printed lines 1.6 mm wide with gaps as wide, edges 0.15 mm wide, four times as bright as the ground.
fn print(x: f64, y: f64) -> f64 {
    let wave = (y / 1.6 * std::f64::consts::PI + 0.3 * x).sin();
    0.25 + 0.75 / (1.0 + (-wave * 1.6 / std::f64::consts::PI / 0.05).exp())
}

const PRINTED: Scene = Scene {
    shots: 60,
    along: Along::U,
    gone: f64::from,
    step: 0.25,
    turn: 0.0,
    thick: 0.1,
    height: |x, y| 0.05 * x + 0.1 * y,
    albedo: print,
    speckle: 0.03,
    flicker: 0.0,
    focal_px: 600.0,
};
const NOISE_MM: f64 = 0.01;

fn sheet() -> Plane<Camera> {
    Plane::new(Vec3::new(0.0, 150.0, 60.0), 9000.0).unwrap()
}

impl Scene {
    /// The light on the surface is a Gaussian about the sheet's middle times the surface's albedo. A point lies
    /// where the sheet's middle meets the ray of that light's centre.
    fn scan(&self, seed: u64) -> (Vec<CloudPoint>, Shots) {
        let mut noise = Noise(seed);
        let (mut cloud, mut places) = (Vec::new(), Vec::new());
        for shot in 0..self.shots {
            let k = (self.gone)(shot);
            let turned = exp(&(Vec3::z() * (self.turn * k))) * exp(&(Vec3::x() * std::f64::consts::PI));
            let place: Rigid<Base, Camera> = Rigid::new(turned, Vec3::new(0.0, self.step * k, 150.0));
            let laser = (self.flicker * noise.normal()).exp();
            for column in 0..200 {
                let x = 0.1 * f64::from(column) - 10.0;
                let seen = |y: f64| {
                    let on = place.point(&Vec3::new(x, y, 150.0));
                    let on = Vec3::new(on.x, on.y, (self.height)(on.x, on.y));
                    (on, place.inverse().point(&on))
                };
                let middle = (0..20).fold(0.0, |y, _| y - sheet().distance(&seen(y).1));
                let (mut light, mut ray) = (0.0, Vec3::zeros());
                for part in -60..=60 {
                    let (on, seen) = seen(middle + f64::from(part) * 0.1 * self.thick);
                    let off = sheet().distance(&seen) / self.thick;
                    let here = (-0.5 * off * off).exp() * (self.albedo)(on.x, on.y);
                    light += here;
                    ray += here * seen / seen.z;
                }
                let ray = ray / light;
                let depth = sheet().offset / sheet().normal.dot(&ray);
                let at = place.point(&(ray * depth)) + Vec3::z() * (NOISE_MM * noise.normal());
                let (u, v) = ((self.focal_px * ray.x) as f32, 200.0 + (self.focal_px * ray.y) as f32);
                let (u, v) = if self.along == Along::U { (u, v) } else { (v, u) };
                let intensity = (8.0 * laser * light * (self.speckle * noise.normal()).exp()) as f32;
                let position = glam::DVec3::from_array(at.into()).as_vec3();
                cloud.push(CloudPoint {
                    position,
                    intensity,
                    sigma_mm: NOISE_MM as f32,
                    shot,
                    u,
                    v,
                    ..Default::default()
                });
            }
            places.push((shot, place));
        }
        let stripe_px = self.focal_px * self.thick / 150.0;
        let mut shots = Shots::new(self.along, places).with_stripe(Some(stripe_px as f32));
        shots.sheet = Some(sheet());
        (cloud, shots)
    }

    fn rms(&self, cloud: &[CloudPoint]) -> f64 {
        let off = |p: &CloudPoint| {
            let [x, y, z] = p.position.as_dvec3().to_array();
            (z - (self.height)(x, y)).powi(2)
        };
        (cloud.iter().map(off).sum::<f64>() / cloud.len() as f64).sqrt()
    }

    /// The result, and the points' rms distance from the surface before and after.
    fn refined(&self, seed: u64) -> (Option<SheetFound>, f64, f64) {
        let (cloud, shots) = self.scan(seed);
        let before = self.rms(&cloud);
        let Some(thick) = Thick::of(&cloud, &shots).unwrap() else { return (None, before, before) };
        let mut after = Vec::new();
        let found = thick.apply(&cloud, &shots, &mut |points| {
            after.extend_from_slice(points);
            Ok(())
        });
        assert_eq!(after.len(), cloud.len());
        (Some(found.unwrap()), before, self.rms(&after))
    }
}

/// Lying and upright stripes, forwards and back, straight and turning, with shots a quarter to 4 standard
/// deviations of the sheet apart.
#[test]
fn print_no_longer_pulls_the_points_about() {
    for (name, scene) in [
        ("as it is", PRINTED),
        ("upright", Scene { along: Along::V, ..PRINTED }),
        ("back", Scene { step: -0.25, ..PRINTED }),
        ("turning", Scene { turn: 0.004, ..PRINTED }),
        ("fine", Scene { step: 0.1, shots: 150, ..PRINTED }),
        ("coarse", Scene { step: 0.35, ..PRINTED }),
        ("dense", Scene { focal_px: 1500.0, step: 0.025, shots: 400, ..PRINTED }),
        ("dense, back, upright", Scene { focal_px: 1500.0, step: -0.025, shots: 400, along: Along::V, ..PRINTED }),
        ("dense, speckled", Scene { focal_px: 1500.0, step: 0.025, shots: 400, speckle: 0.06, ..PRINTED }),
        ("thick", Scene { thick: 0.2, ..PRINTED }),
        ("thin", Scene { thick: 0.06, ..PRINTED }),
        ("flickering", Scene { flicker: 0.03, ..PRINTED }),
        ("speckled", Scene { speckle: 0.2, ..PRINTED }),
        ("fine pixels, steep", Scene { height: |x, y| 0.3 * x - 0.5 * y, focal_px: 12_000.0, ..PRINTED }),
        ("fine pixels", Scene { focal_px: 12_000.0, ..PRINTED }),
        ("steep", Scene { height: |x, y| 0.3 * x - 0.5 * y, ..PRINTED }),
        ("round", Scene { height: |x, y| 0.02 * x * x - 0.01 * (y - 7.0).powi(2), ..PRINTED }),
    ] {
        let (found, before, after) = scene.refined(7);
        let found = found.unwrap_or_else(|| panic!("{name}: nothing is found"));
        println!("{name}: {found}; {before:.4} -> {after:.4} mm");
        // Noise alone is 0.01 mm.
        assert!(after < 0.7 * before, "{name}: {before} -> {after}");
        let ratio = found.thickness_mm / scene.thick;
        assert!((0.7..1.6).contains(&ratio), "{name}: {found:?}");
    }
}

/// Shots of a camera that stands show no slope of the light. They neither throw points far off nor hide the effect.
#[test]
fn a_camera_that_stands_ruins_nothing() {
    let stands: [(&str, fn(u32) -> f64, f64); 6] = [
        ("one picture more", |k| f64::from(k - u32::from(k > 20)), 0.7),
        ("four", |k| f64::from(k.min(20) + k.saturating_sub(24)), 0.7),
        ("a third of the scan", |k| f64::from(k.min(20) + k.saturating_sub(40)), 0.9),
        ("at the start and the end", |k| f64::from(k.clamp(8, 50)), 0.8),
        ("trembling by 0.01 of a step", |k| f64::from(k.min(20) + k.saturating_sub(24)) + 0.01 * f64::from(k % 3), 0.7),
        (
            "a slow stretch",
            |k| f64::from(k.min(20)) + 0.1 * f64::from(k.clamp(20, 40) - 20) + f64::from(k.max(40) - 40),
            0.7,
        ),
    ];
    for (name, gone, left) in stands {
        let scene = Scene { gone, ..PRINTED };
        let (found, before, after) = scene.refined(7);
        let found = found.unwrap_or_else(|| panic!("{name}: nothing is found"));
        println!("{name}: {found}; {before:.4} -> {after:.4} mm");
        assert!(after < left * before, "{name}: {before} -> {after}");
        assert!((0.7..1.6).contains(&(found.thickness_mm / scene.thick)), "{name}: {found:?}");
    }
}

/// The intersection of the sheet's middle with the ray can be restored.
#[test]
fn points_go_back_onto_the_sheet() {
    let (cloud, shots) = PRINTED.scan(5);
    let thick = Thick::of(&cloud, &shots).unwrap().unwrap();
    let mut after = Vec::new();
    let taken = thick.apply(&cloud, &shots, &mut |points| {
        after.extend_from_slice(points);
        Ok(())
    });
    taken.unwrap();
    // Noise along the vertical has moved the points off the sheet.
    let mut before = cloud.clone();
    shots.onto_sheet(&mut before);
    let apart = |a: &[CloudPoint], b: &[CloudPoint]| {
        a.iter().zip(b).map(|(a, b)| a.position.distance(b.position)).fold(0.0, f32::max)
    };
    let moved = apart(&before, &after);
    shots.onto_sheet(&mut after);
    println!("{moved} mm apart, {} back on the sheet", apart(&before, &after));
    assert!(moved > 0.05 && apart(&before, &after) < 1e-4);
}

/// The remaining error of a corrected point is in its standard deviation.
#[test]
fn points_that_were_moved_state_it() {
    let (mut cloud, shots) = PRINTED.scan(3);
    // One point that is not determined, and an exact one.
    for (p, sigma_mm) in cloud[5000..].iter_mut().zip([f32::INFINITY, 0.0]) {
        p.sigma_mm = sigma_mm;
    }
    let thick = Thick::of(&cloud, &shots).unwrap().unwrap();
    let mut after = Vec::new();
    let found = thick.apply(&cloud, &shots, &mut |points| {
        after.extend_from_slice(points);
        Ok(())
    });
    let beyond = |cloud: &[CloudPoint]| {
        let off = |p: &&CloudPoint| {
            let [x, y, z] = p.position.as_dvec3().to_array();
            (z - (PRINTED.height)(x, y)).abs() > 3.0 * f64::from(p.sigma_mm)
        };
        cloud.iter().filter(off).count() as f64 / cloud.len() as f64
    };
    let (before, after) = (beyond(&cloud), beyond(&after));
    println!("beyond three standard deviations: {before:.4} -> {after:.4}");
    assert!(before > 0.2 && after < 0.02, "{before} -> {after}");
    let SheetFound { moved, scatter_mm, .. } = found.unwrap();
    assert!((0.2..0.7).contains(&moved) && (0.1..0.2).contains(&scatter_mm), "{moved}, {scatter_mm}");
}

/// Without an effect nothing is moved: uniform brightness, speckle, a flickering laser, a thin sheet, bright
/// ridges, few shots, shots with unknown poses.
#[test]
fn what_is_not_pulled_is_not_moved() {
    let even = Scene { albedo: |_, _| 1.0, ..PRINTED };
    // With a thin sheet the intensity follows the surface's brightness without shifting any point.
    let thin = Scene { thick: 0.005, ..PRINTED };
    // 0.3 mm high, in the shape of the print.
    let ridges = Scene { height: |x, y| 0.4 * print(x, y), ..thin };
    for (name, scene) in [
        ("even", even),
        ("speckled", Scene { speckle: 0.3, ..even }),
        ("flickering", Scene { flicker: 0.2, ..even }),
        ("thin", thin),
        ("ridges", ridges),
        ("few", Scene { shots: 3, ..PRINTED }),
        ("dense, speckled", Scene { focal_px: 1500.0, step: 0.025, shots: 300, speckle: 0.3, ..even }),
        ("dense, flickering", Scene { focal_px: 1500.0, step: 0.025, shots: 300, flicker: 0.2, ..even }),
        ("dense, thin", Scene { step: 0.025, shots: 300, ..thin }),
        ("dense ridges", Scene { step: 0.025, shots: 300, ..ridges }),
    ] {
        for seed in 0..if scene.shots > 60 { 2 } else { 5 } {
            let (found, before, after) = scene.refined(seed);
            println!("{name}: {found:?}: {before:.4} -> {after:.4}");
            assert!(found.is_none() && before == after, "{name}: {found:?}: {before} -> {after}");
        }
    }
    let (cloud, shots) = PRINTED.scan(1);
    assert!(Thick::of(&cloud, &Shots::unplaced(shots.along)).unwrap().is_none());
    assert!(Thick::of(&Vec::new(), &shots).unwrap().is_none());
}
