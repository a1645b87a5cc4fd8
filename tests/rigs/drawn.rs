//! In: a seed. Out: a design that nobody chose, from the space that stations are built in: picture, lens, sensor,
//! side and angle of the laser, width of the stripe, distance. Frame and unit: as [`RigSpec`].

use rand::{Rng, SeedableRng};
use sheetlight::simulate::RigSpec;
use sheetlight::simulate::rig_scene::TREAD_MM;

/// Half-width of the sheet, px of the camera at the working distance (1 sigma), is drawn from here, the widest by
/// their share of the picture's shorter side; the part's treads may ask for less (at the end).
const STRIPE_PX: [f64; 2] = [0.8, 6.0];
const STRIPE_SHARE: f64 = 0.006;

/// The design of a seed.
pub fn rig(seed: u64) -> RigSpec {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
    // Sizes and distances are drawn evenly by their logarithm.
    let mut even = |low: f64, high: f64| rng.random_range(low..high);
    let log = |even: &mut dyn FnMut(f64, f64) -> f64, low: f64, high: f64| even(low.ln(), high.ln()).exp();
    let mut spec = RigSpec::paper();
    spec.name = format!("drawn {seed}");
    spec.pointer = None;

    let long = log(&mut even, 480.0, 1000.0).round();
    let short = (long * even(0.56, 1.0)).round();
    let portrait = even(0.0, 1.0) < 0.3;
    let [width, height] = if portrait { [short, long] } else { [long, short] };
    let distance = log(&mut even, 60.0, 1200.0);
    // Half of the longer side's view, as a tangent: 5 to 33 degrees.
    let half_view = log(&mut even, 0.09, 0.65);
    let camera = &mut spec.camera;
    [camera.width_px, camera.height_px] = [width, height].map(|n| n as u32);
    camera.pixel_um = log(&mut even, 2.2, 9.0);
    camera.focal_mm = 0.5 * long / half_view * camera.pixel_um * 1e-3;
    // At the picture's end: from 15 % of barrel to 5 % of pincushion for wide views, less for narrow ones.
    let bend = even(-0.15, 0.05) * (half_view / 0.65);
    let k1 = bend / (half_view * half_view);
    // A lens that holds angles instead of tangents (f-theta): -1/3, 1/5. With k1 alone its picture would fold over.
    let k2 = if k1 < 0.0 { 1.8 * k1 * k1 } else { 0.0 };
    camera.distortion = [k1, k2, even(-4e-4, 4e-4), even(-4e-4, 4e-4), 0.0];
    camera.sensor_tilt_deg = [0.0; 2];

    let sensor = &mut spec.sensor;
    sensor.bits = [8, 10, 12][even(0.0, 3.0) as usize];
    sensor.blur_px = even(0.4, 1.2);
    sensor.full_well_e = log(&mut even, 5000.0, 40_000.0);
    sensor.read_noise_e = even(2.0, 15.0);
    sensor.speckle = even(0.05, 0.2);

    let laser = &mut spec.laser;
    laser.side_deg = even(0.0, 360.0);
    laser.angle_deg = even(13.0, 55.0);
    // The stripe passes within three tenths of the shorter side's half from the picture's middle.
    let beside = even(-0.3, 0.3) * half_view * short / long / laser.angle_deg.to_radians().tan();
    let crossing = distance * (1.0 + beside);
    laser.crosses_axis_at_mm = Some(crossing);
    laser.baseline_mm = crossing * laser.angle_deg.to_radians().tan();
    laser.fan_deg = even(40.0, 90.0);
    let stripe = log(&mut even, STRIPE_PX[0], STRIPE_PX[1].min(STRIPE_SHARE * short));
    let slope = laser.angle_deg.to_radians().cos();
    let range = crossing / slope;
    laser.waist_radius_mm = 2.0 * stripe * distance / (camera.focal_mm / (camera.pixel_um * 1e-3));
    laser.waist_at_mm = range;
    laser.wavelength_nm = even(405.0, 660.0);

    let working = &mut spec.working;
    working.distance_mm = distance;
    working.near_mm = distance * even(0.75, 0.85);
    working.far_mm = distance * even(1.15, 1.3);
    working.lean_deg = 0.0;
    spec.mount.turn_deg = even(-180.0, 180.0);

    // On a level face the sheet's width is 1 / cos wider, and profiles along an image axis go farther along a slanted
    // stripe (the judge's margin): what is left of a tread of the part is a quarter at least.
    let (s, c) = spec.laser.side_deg.to_radians().sin_cos();
    let lean = s.abs().min(c.abs()) / s.abs().max(c.abs());
    let widest = 0.75 * 0.5 * TREAD_MM[0] * spec.scale() / (3.0 * (1.0 + lean));
    let blur = spec.sensor.blur_px * spec.footprint_mm();
    spec.laser.waist_radius_mm = spec.laser.waist_radius_mm.min(2.0 * slope * (widest * widest - blur * blur).sqrt());
    spec
}
