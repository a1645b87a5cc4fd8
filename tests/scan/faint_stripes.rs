//! In: faint stripes in noise, in every direction, as wide as stripes are, at 8 bits and at 12. Out: how much of each
//! is found by what `scan` runs and how many specks are taken for light, beside the same with every lit pixel fitted.
//! Frame and unit: px; noise and light in grey levels of an 8-bit picture.

use glam::Vec3;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use sheetlight::raster::Image;
use sheetlight::scan::{Extraction, Format};
use sheetlight::stages::cases;
use sheetlight::stages::chain::config::ChainConfig;
use sheetlight::stages::host::{Found, Host};
use sheetlight::stages::peak::params::Stripe;
use sheetlight::stages::stripe::point::Optics;
use sheetlight::stages::stripe::spacing::COMPANY;

const EDGE: u32 = 640;
const DARK: f64 = 15.0;
/// The stripe stays this far from the corners, px.
const LENGTH: f64 = 560.0;
/// Of what is found with every lit pixel fitted, so much is to stay; and so many specks may.
const STAYS: f64 = 0.98;
const SPECKS: f64 = 0.25;
/// Of the pixel steps along a stripe, so many are found; with light looked for four sigmas above the noise it is a
/// third.
const FOUND: f64 = 0.5;

#[derive(Clone, Copy, Debug)]
struct Case {
    /// Of the stripe against the rows.
    angle_deg: f64,
    width_px: f64,
    noise: f64,
    /// Height over the noise.
    contrast: f64,
    bits: u8,
}

impl Case {
    /// Offsets of a pixel across and along the stripe.
    fn offsets(&self, x: f64, y: f64) -> (f64, f64) {
        let (s, c) = self.angle_deg.to_radians().sin_cos();
        let (x, y) = (x - 0.5 * f64::from(EDGE) - 0.3, y - 0.5 * f64::from(EDGE) - 0.2);
        (y * c - x * s, x * c + y * s)
    }

    fn picture(&self, seed: u64) -> Image {
        let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
        let scale = f64::from((1u32 << self.bits) - 1) / 255.0;
        cases::drawn(EDGE, EDGE, self.bits, |x, y| {
            let (d, t) = self.offsets(f64::from(x), f64::from(y));
            let on = f64::from(u8::from(t.abs() < 0.5 * LENGTH));
            let light = on * self.contrast * self.noise * (-0.5 * (d / self.width_px).powi(2)).exp();
            let noise: f64 = StandardNormal.sample(&mut random);
            ((DARK + light + self.noise * noise) * scale).round().clamp(0.0, 255.0 * scale) as u32
        })
    }

    /// A sheet that is seen in this direction.
    fn optics(&self) -> Optics {
        let (s, c) = self.angle_deg.to_radians().sin_cos();
        let normal = Vec3::new(-0.88 * s as f32, 0.88 * c as f32, 0.4694).normalize();
        Optics { normal, ..cases::optics(EDGE, EDGE) }
    }

    fn config(&self) -> ChainConfig {
        let stripe = Stripe { width_px: self.width_px as f32, noise: self.noise as f32, ..Stripe::default() };
        let format = Format { width: EDGE, height: EDGE, bits: self.bits };
        Extraction::default().for_stripe(&stripe).chain(format, self.optics(), stripe.width_px)
    }

    /// Pixels of length with a believed peak on the stripe; believed peaks elsewhere.
    fn count(&self, found: &Found) -> (usize, usize) {
        let mut places = std::collections::BTreeSet::new();
        let mut specks = 0;
        for peak in found.peaks.iter().filter(|p| p.kept()) {
            let (d, t) = self.offsets(f64::from(peak.u), f64::from(peak.v));
            if d.abs() < 2.0 * self.width_px.max(1.0) && t.abs() < 0.5 * LENGTH {
                places.insert(t.round() as i32);
            } else if d.abs() > 6.0 * self.width_px + 8.0 {
                specks += 1;
            }
        }
        (places.len(), specks)
    }
}

#[test]
fn faint_stripes_keep_their_points_and_specks_go() {
    let mut cases = Vec::new();
    for angle_deg in [0.0, 12.0, 45.0, 78.0, 90.0, 135.0] {
        for width_px in [0.7, 1.2, 2.5, 5.0] {
            for (noise, contrast) in [(2.0, 5.0), (3.0, 4.0), (3.0, 6.0), (5.0, 4.0)] {
                let bits = if angle_deg == 12.0 { 12 } else { 8 };
                cases.push(Case { angle_deg, width_px, noise, contrast, bits });
            }
        }
    }
    let judged: Vec<_> = (0u64..)
        .zip(cases)
        .collect::<Vec<_>>()
        .into_par_iter()
        .map(|(seed, case)| {
            let (image, config) = (case.picture(seed), case.config());
            assert_ne!(config.spacing & COMPANY, 0);
            let every = ChainConfig { spacing: config.spacing & !COMPANY, ..case.config() };
            let run = |c: &ChainConfig| case.count(&Host::new(c).unwrap().run(0, &image, &cases::pose(0)).unwrap());
            (case, run(&config), run(&every))
        })
        .collect();
    let mut faults = Vec::new();
    let mut specks = [0, 0];
    for (case, (on, off), (all, noise)) in judged {
        println!("{case:?}: {on} of {all} px found of {LENGTH}, {off} of {noise} specks");
        specks = [specks[0] + off, specks[1] + noise];
        let (s, c) = case.angle_deg.to_radians().sin_cos();
        if (on as f64) < FOUND * LENGTH * s.abs().max(c.abs()) {
            faults.push(format!("{case:?}: {on} px found"));
        }
        if (on as f64) < STAYS * all as f64 {
            faults.push(format!("{case:?}: {on} px of {all}"));
        }
    }
    println!("{} of {} specks", specks[0], specks[1]);
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(specks[1] > 100 && (specks[0] as f64) < SPECKS * specks[1] as f64, "{specks:?}");
}
