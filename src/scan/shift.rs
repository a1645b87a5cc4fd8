//! In: pictures of a stripe on a bed that moves under camera and laser, and three numbers of the rig.
//! Out: heights above the bed from the stripe's sideways shift, for rigs without a camera calibration.
//! Frame and unit: x along the stripe, y along the travel, z up from the bed; mm (docs/math.md, Shift (1)).

use super::CloudPoint;
use crate::fault::{Fault, Result};
use crate::raster::{Channel, Image};
use crate::stages::{Thinning, ThresholdParams, skeleton, thin, threshold};
use std::path::{Path, PathBuf};

/// To which side of the picture a raised surface moves the stripe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    Left,
    Right,
}

impl std::str::FromStr for Side {
    type Err = String;
    fn from_str(s: &str) -> std::result::Result<Side, String> {
        match s {
            "left" => Ok(Side::Left),
            "right" => Ok(Side::Right),
            _ => Err(format!("unknown side '{s}': left or right")),
        }
    }
}

/// A rig whose stripe runs along image columns.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct ShiftRig {
    /// Pixels per mm on the bed, 0.1..=1000.
    pub pixels_per_mm: f64,
    /// Camera above the bed, mm, 1..=10000.
    pub camera_height_mm: f64,
    /// Laser beside the camera, mm, 1..=10000.
    pub baseline_mm: f64,
    pub raises: Side,
    /// Travel of the bed from picture to picture, mm, 0.001..=100.
    pub travel_mm: f64,
    /// Rows that always show the bare bed: they give the zero of each picture.
    pub bed_rows: Vec<[u32; 2]>,
    pub channel: Channel,
}

impl ShiftRig {
    pub fn check(&self) -> Result<()> {
        for (name, value, low, high) in [
            ("pixels per mm", self.pixels_per_mm, 0.1, 1000.0),
            ("camera height in mm", self.camera_height_mm, 1.0, 1e4),
            ("baseline in mm", self.baseline_mm, 1.0, 1e4),
            ("travel in mm", self.travel_mm, 1e-3, 100.0),
        ] {
            if !(low..=high).contains(&value) {
                return Err(
                    Fault::usage(format!("{name} is {value}, allowed {low}..={high}")).next("correct the option")
                );
            }
        }
        if self.bed_rows.is_empty() || self.bed_rows.iter().any(|[a, b]| a >= b) {
            return Err(Fault::usage(format!("bed rows {:?} name no rows", self.bed_rows)).next("give e.g. 5..40"));
        }
        Ok(())
    }

    /// Height of a stripe that is shifted by `px`, and d(height)/d(px); docs/math.md, Shift (1).
    pub fn height(&self, px: f64) -> (f64, f64) {
        let (s, d) = (px / self.pixels_per_mm, self.baseline_mm);
        (self.camera_height_mm * s / (d + s), self.camera_height_mm * d / (d + s).powi(2) / self.pixels_per_mm)
    }
}

/// The stripe in one row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Middle between the flanks, px.
    pub u: f64,
    /// Its standard deviation, px.
    pub sigma_px: f64,
    /// Grey levels above the row's background.
    pub amplitude: f64,
    pub saturated: bool,
}

/// Grey levels that a stripe must rise above its row's background: ten times a webcam's noise.
const FAINTEST: f64 = 30.0;
/// Noise of a grey level on a flank, for the sigma: photographs are compressed and speckled.
const NOISE: f64 = 5.0;

/// The stripe of each row: of the skeleton's places the one with most light, refined to the middle
/// between the places where its flanks cross half of its height. On glaring metal the top is cut off
/// by saturation and says nothing, and the width changes tenfold within a picture; the flanks hold.
pub fn stripe_by_row(image: &Image) -> Vec<Option<Crossing>> {
    let window = ThresholdParams { size: 101, ..ThresholdParams::default() };
    let skeleton = skeleton::twin(&thin::twin(&threshold::twin(image, &window), Thinning::default()));
    let (width, grey, full) = (image.width as usize, image.to_f32(), f64::from(image.full_scale()));
    let mut best: Vec<Option<(f64, Crossing)>> = vec![None; image.height as usize];
    let backgrounds: Vec<f64> = grey.chunks_exact(width).map(middle_level).collect();
    for pixel in skeleton {
        let (x, y) = ((pixel & 0xffff) as usize, (pixel >> 16) as usize);
        let row = &grey[y * width..(y + 1) * width];
        let Some((crossing, run)) = flanks(row, x, backgrounds[y], full) else { continue };
        let light = run * crossing.amplitude;
        if best[y].is_none_or(|(most, _)| light > most) {
            best[y] = Some((light, crossing));
        }
    }
    best.into_iter().map(|b| b.map(|(_, crossing)| crossing)).collect()
}

fn middle_level(row: &[f32]) -> f64 {
    let mut sorted = row.to_vec();
    let middle = sorted.len() / 2;
    f64::from(*sorted.select_nth_unstable_by(middle, f32::total_cmp).1)
}

/// The middle between the half-height crossings about pixel `x`, and the distance between them.
fn flanks(row: &[f32], x: usize, background: f64, full: f64) -> Option<(Crossing, f64)> {
    let at = |i: usize| f64::from(row[i]);
    let top = (x.saturating_sub(2)..(x + 3).min(row.len())).map(at).fold(0.0, f64::max);
    let amplitude = top - background;
    let half = background + amplitude / 2.0;
    if amplitude < FAINTEST || at(x) < half {
        return None;
    }
    let (mut a, mut b) = (x, x);
    while a > 0 && at(a) >= half {
        a -= 1;
    }
    while b + 1 < row.len() && at(b) >= half {
        b += 1;
    }
    // A stripe that leaves the picture has one flank only.
    if at(a) >= half || at(b) >= half {
        return None;
    }
    let (rise, fall) = (at(a + 1) - at(a), at(b - 1) - at(b));
    let left = a as f64 + (half - at(a)) / rise;
    let right = b as f64 - (half - at(b)) / fall;
    let sigma_px = 0.5 * NOISE * (1.0 / rise).hypot(1.0 / fall);
    let crossing = Crossing { u: (left + right) / 2.0, sigma_px, amplitude, saturated: top >= full };
    Some((crossing, right - left))
}

/// Points of one picture; empty where the bed rows do not show the bed.
fn points(rows: &[Option<Crossing>], shot: u32, rig: &ShiftRig) -> Vec<CloudPoint> {
    let bed = |v: usize| rig.bed_rows.iter().any(|[a, b]| (*a as usize..=*b as usize).contains(&v));
    let found = || rows.iter().enumerate().filter_map(|(v, k)| k.map(|k| (v, k)));
    let zero: Vec<(f64, f64)> = found().filter(|(v, _)| bed(*v)).map(|(v, k)| (v as f64, k.u)).collect();
    let Some((u0, slope)) = robust_line(&zero) else { return Vec::new() };
    let sign = if rig.raises == Side::Left { -1.0 } else { 1.0 };
    let point = |(v, k): (usize, Crossing)| {
        let (z, mm_per_px) = rig.height(sign * (k.u - u0 - slope * v as f64));
        CloudPoint {
            position: [(v as f64 / rig.pixels_per_mm) as f32, (f64::from(shot) * rig.travel_mm) as f32, z as f32],
            sigma_mm: (k.sigma_px * mm_per_px) as f32,
            intensity: k.amplitude as f32,
            quality: if k.saturated { 0.5 } else { 1.0 },
            shot,
            u: k.u as f32,
            v: v as f32,
        }
    };
    found().map(point).filter(|p| p.position[2].is_finite()).collect()
}

/// u = a + b v by the median of slopes and of offsets (Theil 1950; docs/math.md, Shift); half of the points may be wrong.
fn robust_line(points: &[(f64, f64)]) -> Option<(f64, f64)> {
    if points.len() < 10 {
        return None;
    }
    let median = |mut x: Vec<f64>| {
        x.sort_unstable_by(f64::total_cmp);
        x[x.len() / 2]
    };
    let half = points.len() / 2;
    let slopes = (0..half).map(|i| (points[i], points[i + points.len() - half]));
    let slope = median(slopes.map(|(a, b)| (b.1 - a.1) / (b.0 - a.0)).collect());
    Some((median(points.iter().map(|(v, u)| u - slope * v).collect()), slope))
}

/// A level surface in a scan: the most frequent height above the bed.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Plateau {
    /// Median of the points within 0.5 mm of the most frequent height, mm.
    pub height_mm: f64,
    /// Their robust standard deviation (1.4826 MAD), mm.
    pub noise_mm: f64,
    /// Standard deviation of the medians of single pictures, mm: what travels with the picture and does not average.
    pub between_shots_mm: f64,
    pub points: usize,
    pub shots: usize,
}

/// What a shift scan came to.
#[derive(Clone, Debug, serde::Serialize)]
pub struct ShiftReport {
    pub rig: ShiftRig,
    pub pictures: usize,
    pub points: usize,
    /// Pictures whose bed rows did not show the bed.
    pub without_bed: Vec<String>,
    /// The bed itself: noise of the zero.
    pub bed_noise_mm: f64,
    pub plateau: Option<Plateau>,
}

/// Scans a folder of pictures, in the order of their names.
pub fn shift_scan(
    folder: &Path,
    rig: &ShiftRig,
    min_height_mm: f64,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<(ShiftReport, Vec<CloudPoint>)> {
    rig.check()?;
    let names = pictures(folder)?;
    let mut report = ShiftReport {
        rig: rig.clone(),
        pictures: names.len(),
        points: 0,
        without_bed: vec![],
        bed_noise_mm: f64::NAN,
        plateau: None,
    };
    let mut cloud = Vec::new();
    for (i, path) in names.iter().enumerate() {
        let image = crate::raster::load(path, rig.channel, 8)?;
        let found = points(&stripe_by_row(&image), i as u32, rig);
        if found.is_empty() {
            report.without_bed.push(path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned()));
        }
        cloud.extend(found);
        progress(i + 1, names.len());
    }
    report.points = cloud.len();
    let in_bed = |p: &CloudPoint| rig.bed_rows.iter().any(|[a, b]| (*a as f32..=*b as f32).contains(&p.v));
    let bed: Vec<f64> = cloud.iter().filter(|p| in_bed(p)).map(|p| f64::from(p.position[2])).collect();
    report.bed_noise_mm = spread(&bed).1;
    let raised: Vec<CloudPoint> =
        cloud.iter().filter(|p| !in_bed(p) && f64::from(p.position[2]) > min_height_mm).copied().collect();
    report.plateau = plateau(&raised);
    Ok((report, cloud))
}

fn pictures(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder).map_err(|e| Fault::read(folder, e))?;
    let known = |p: &PathBuf| {
        let extension = p.extension().map(|e| e.to_string_lossy().to_lowercase());
        extension.is_some_and(|e| ["jpg", "jpeg", "png", "tif", "tiff", "bmp", "pgm"].contains(&e.as_str()))
    };
    let mut names: Vec<PathBuf> = entries.flatten().map(|e| e.path()).filter(known).collect();
    names.sort_by_key(|p| crate::files::natural(&p.to_string_lossy()));
    if names.is_empty() {
        return Err(Fault::input(format!("{}: holds no pictures", folder.display()))
            .cause("another folder, or pictures of another format than JPEG, PNG, TIFF, BMP, PGM")
            .next("give the folder with the pictures"));
    }
    Ok(names)
}

/// Median and 1.4826 times the median absolute deviation.
fn spread(values: &[f64]) -> (f64, f64) {
    if values.is_empty() {
        return (f64::NAN, f64::NAN);
    }
    let median = |mut x: Vec<f64>| {
        x.sort_unstable_by(f64::total_cmp);
        x[x.len() / 2]
    };
    let middle = median(values.to_vec());
    (middle, 1.4826 * median(values.iter().map(|x| (x - middle).abs()).collect()))
}

fn plateau(raised: &[CloudPoint]) -> Option<Plateau> {
    if raised.len() < 100 {
        return None;
    }
    let bin = |p: &CloudPoint| (f64::from(p.position[2]) / 0.1).floor() as i64;
    let mut counts = std::collections::BTreeMap::new();
    raised.iter().for_each(|p| *counts.entry(bin(p)).or_insert(0usize) += 1);
    let mode = counts.iter().max_by_key(|(_, n)| **n).map(|(b, _)| (*b as f64 + 0.5) * 0.1)?;
    let on: Vec<&CloudPoint> = raised.iter().filter(|p| (f64::from(p.position[2]) - mode).abs() < 0.5).collect();
    let (height_mm, noise_mm) = spread(&on.iter().map(|p| f64::from(p.position[2])).collect::<Vec<_>>());
    let mut shots = std::collections::BTreeMap::<u32, Vec<f64>>::new();
    on.iter().for_each(|p| shots.entry(p.shot).or_default().push(f64::from(p.position[2])));
    let medians: Vec<f64> = shots.values().filter(|z| z.len() >= 10).map(|z| spread(z).0).collect();
    let mean = medians.iter().sum::<f64>() / medians.len().max(1) as f64;
    let variance = medians.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (medians.len().max(2) - 1) as f64;
    Some(Plateau { height_mm, noise_mm, between_shots_mm: variance.sqrt(), points: on.len(), shots: medians.len() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rig() -> ShiftRig {
        ShiftRig {
            pixels_per_mm: 10.0,
            camera_height_mm: 80.0,
            baseline_mm: 40.0,
            raises: Side::Left,
            travel_mm: 1.0,
            bed_rows: vec![[5, 60], [240, 290]],
            channel: Channel::Luma,
        }
    }

    /// A vertical stripe, thin on the bed and wide and saturated on a step.
    fn picture(shift: f64) -> Image {
        let mut pixels = vec![0u8; 400 * 300];
        for v in 0..300usize {
            let on = (100..200).contains(&v);
            let (u, sigma, top) = if on { (260.3 - shift, 4.0, 700.0) } else { (260.3, 1.6, 180.0) };
            for x in 0..400usize {
                let g: f64 = 4.0 + top * (-0.5 * ((x as f64 - u) / sigma).powi(2)).exp();
                pixels[v * 400 + x] = g.min(255.0) as u8;
            }
        }
        Image::from_u8(400, 300, pixels)
    }

    #[test]
    fn the_height_follows_the_shift_of_a_stripe_of_any_width() {
        for shift in [20.0, 61.5] {
            let found = points(&stripe_by_row(&picture(shift)), 3, &rig());
            let top: Vec<f64> =
                found.iter().filter(|p| (110.0..190.0).contains(&p.v)).map(|p| f64::from(p.position[2])).collect();
            assert!(top.len() > 75, "{}", top.len());
            let want = 80.0 * (shift / 10.0) / (40.0 + shift / 10.0);
            let (height, _) = spread(&top);
            assert!((height - want).abs() < 0.02, "{height} {want}");
            let bed: Vec<f64> = found.iter().filter(|p| p.v < 90.0).map(|p| f64::from(p.position[2])).collect();
            assert!(spread(&bed).0.abs() < 0.01);
        }
    }

    #[test]
    fn senseless_rigs_are_refused() {
        assert!(ShiftRig { pixels_per_mm: 0.0, ..rig() }.check().is_err());
        assert!(ShiftRig { bed_rows: vec![[40, 5]], ..rig() }.check().is_err());
        let dir = tempfile::tempdir().unwrap();
        assert!(shift_scan(dir.path(), &rig(), 1.0, &mut |_, _| {}).unwrap_err().what.contains("no pictures"));
    }
}
