//! In: pictures of a stripe on a bed that moves under camera and laser, and three numbers of the rig.
//! Out: heights above the bed from the stripe's sideways shift, for rigs without a camera calibration.
//! Frame and unit: x along the stripe, y along the travel, z up from the bed; mm (docs/math.md, Shift (1)).

use super::crossing::{Crossing, stripe_by_row};
use super::folder::{Alike, gaps, name, pictures};
use super::judge::{beds, below};
use super::plateau::{Plateau, plateau, spread};
use crate::fault::{Fault, Result};
use crate::raster::{Channel, Depth};
use crate::scan::CloudPoint;
use std::path::{Path, PathBuf};

/// To which side of the picture a raised surface moves the stripe.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    serde::Serialize,
    serde::Deserialize,
    strum::EnumString,
    strum::IntoStaticStr,
    strum::VariantArray,
)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase", parse_err_ty = String, parse_err_fn = unknown)]
pub enum Side {
    /// Towards smaller columns.
    Left,
    /// Towards larger columns.
    Right,
}

fn unknown(word: &str) -> String {
    crate::fault::unknown::<Side>("side", word)
}

/// A rig whose stripe runs along image columns.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct ShiftRig {
    /// Pixels per mm on the bed, 0.1..=1000.
    pub pixels_per_mm: f64,
    /// Height of the camera above the bed, mm, 1..=10000.
    pub camera_height_mm: f64,
    /// Distance of the laser from the camera, mm, 1..=10000.
    pub baseline_mm: f64,
    /// To which side of the picture a raised surface moves the stripe.
    pub raises: Side,
    /// Travel of the bed from picture to picture, mm, 0.001..=100.
    pub travel_mm: f64,
    /// Rows that always show the bare bed; they define zero height in each picture.
    pub bed_rows: Vec<[u32; 2]>,
    /// Which part of a colour picture is used as grey.
    pub channel: Channel,
}

impl ShiftRig {
    /// Refuses numbers outside their ranges, and bed rows that select no row.
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

    /// Whether a row always shows the bare bed.
    fn is_bed(&self, row: f64) -> bool {
        self.bed_rows.iter().any(|[a, b]| (f64::from(*a)..=f64::from(*b)).contains(&row))
    }

    /// Refuses bed rows that begin below the pictures' last row.
    fn rows_within(&self, height: u32) -> Result<()> {
        match self.bed_rows.iter().find(|[first, _]| *first >= height) {
            None => Ok(()),
            Some([first, last]) => Err(Fault::usage(format!(
                "bed rows {first}..{last}: the pictures have the rows 0..{}",
                height.saturating_sub(1)
            ))
            .cause("rows of another size of picture, or columns instead of rows")
            .next("give rows that always show the bare bed")),
        }
    }

    /// First and last of the rows that show the bed.
    fn bed_span(&self) -> [f64; 2] {
        let rows = || self.bed_rows.iter().flatten().map(|v| f64::from(*v));
        [rows().fold(f64::INFINITY, f64::min), rows().fold(0.0, f64::max)]
    }

    /// Height of a stripe that is shifted by `px`, and d(height)/d(px); docs/math.md, Shift (1).
    pub fn height(&self, px: f64) -> (f64, f64) {
        let (s, d) = (px / self.pixels_per_mm, self.baseline_mm);
        (self.camera_height_mm * s / (d + s), self.camera_height_mm * d / (d + s).powi(2) / self.pixels_per_mm)
    }
}

/// The stripe's position on the bed: a line through the bed rows, and the deviation of the empty bed's stripe from
/// such a line.
#[derive(Clone, Debug, Default)]
struct Zero {
    beside: Vec<f64>,
}

impl Zero {
    /// Computed from pictures of the empty bed, which show how the lens and the laser bend the stripe: the median of
    /// each row. A row that fewer than half of them show is interpolated from its neighbours.
    fn of(pictures: &[Vec<Option<Crossing>>], rig: &ShiftRig) -> Option<Zero> {
        let lines: Vec<_> = pictures.iter().filter_map(|p| Some((p, bed_line(p, rig)?))).collect();
        let rows = lines.first()?.0.len();
        let seen: Vec<(usize, f64)> = (0..rows)
            .filter_map(|v| {
                let beside = |(p, (u0, slope)): &(&Vec<Option<Crossing>>, (f64, f64))| {
                    p.get(v)?.map(|k| k.u - u0 - slope * v as f64)
                };
                let all: Vec<f64> = lines.iter().filter_map(beside).collect();
                (2 * all.len() >= lines.len()).then(|| (v, spread(&all).0))
            })
            .collect();
        let at = |v: usize| {
            let next = seen.partition_point(|(row, _)| *row < v);
            match (next.checked_sub(1).map(|i| seen[i]), seen.get(next)) {
                (Some((a, x)), Some(&(b, y))) => x + (y - x) * (v - a) as f64 / (b - a) as f64,
                (Some((_, x)), None) | (None, Some(&(_, x))) => x,
                (None, None) => 0.0,
            }
        };
        (!seen.is_empty()).then(|| Zero { beside: (0..rows).map(at).collect() })
    }
}

/// The line of the bed rows; `None` if they do not show the bed.
fn bed_line(rows: &[Option<Crossing>], rig: &ShiftRig) -> Option<(f64, f64)> {
    let on_bed = |(v, k): (usize, &Option<Crossing>)| k.filter(|_| rig.is_bed(v as f64)).map(|k| (v as f64, k.u));
    robust_line(&rows.iter().enumerate().filter_map(on_bed).collect::<Vec<_>>())
}

/// Points of one picture; empty if the bed rows do not show the bed.
fn points(rows: &[Option<Crossing>], shot: u32, rig: &ShiftRig, zero: &Zero) -> Vec<CloudPoint> {
    let found = || rows.iter().enumerate().filter_map(|(v, k)| k.map(|k| (v, k)));
    let Some((u0, slope)) = bed_line(rows, rig) else { return Vec::new() };
    let bed = |v: usize| u0 + slope * v as f64 + zero.beside.get(v).copied().unwrap_or(0.0);
    let sign = if rig.raises == Side::Left { -1.0 } else { 1.0 };
    let point = |(v, k): (usize, Crossing)| {
        let (z, mm_per_px) = rig.height(sign * (k.u - bed(v)));
        CloudPoint {
            position: [(v as f64 / rig.pixels_per_mm) as f32, (f64::from(shot) * rig.travel_mm) as f32, z as f32]
                .into(),
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

/// u = a + b v by the median of slopes and of offsets (Theil 1950; docs/math.md, Shift); up to half of the points
/// may be outliers.
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

/// Result of a shift scan.
#[derive(Clone, Debug, serde::Serialize)]
pub struct ShiftReport {
    /// The rig, unchanged from the input.
    pub rig: ShiftRig,
    /// Pictures of the scan, not counting those of the empty bed.
    pub pictures: usize,
    /// Points of the cloud, including those on the bed.
    pub points: usize,
    /// Pictures whose bed rows did not show the bed.
    pub without_bed: Vec<String>,
    /// Pictures of the empty bed that gave the zero of each row; 0 without a reference.
    pub reference: usize,
    /// Noise of the zero height on the bed itself, mm.
    pub bed_noise_mm: f64,
    /// The level surface above the bed; `None` if the points do not form one.
    pub plateau: Option<Plateau>,
    /// What is strange about the pictures, a sentence each.
    pub remarks: Vec<String>,
}

/// The error for pictures without the bed.
fn no_bed(folder: &Path, pictures: usize, cause: &str, next: &str) -> Fault {
    Fault::refused(format!("{}: 0 of {pictures} pictures show the bed in the given rows", folder.display()))
        .cause(cause)
        .next(next)
}

/// Scans a folder of pictures, in the order of their names; `reference` holds pictures of the empty bed.
pub fn shift_scan(
    folder: &Path,
    reference: Option<&Path>,
    rig: &ShiftRig,
    min_height_mm: f64,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<(ShiftReport, Vec<CloudPoint>)> {
    rig.check()?;
    let (names, empty) = (pictures(folder)?, reference.map_or(Ok(vec![]), pictures)?);
    let all = names.len() + empty.len();
    let (mut done, mut alike) = (0, Alike::default());
    let mut rows = |path: &PathBuf, alike: &mut Alike| {
        let depth = Depth {
            bits: 8,
            declared: "a shift scan takes",
            correct: "export the pictures with 8 bits a pixel",
            saturates: true,
        };
        let image = crate::raster::load(path, rig.channel, depth)?;
        alike.fits(path, &image)?;
        rig.rows_within(image.height)?;
        let found = stripe_by_row(&image);
        done += 1;
        progress(done, all);
        Ok((found, image))
    };
    let bare = empty.iter().map(|path| Ok(rows(path, &mut alike)?.0)).collect::<Result<Vec<_>>>()?;
    let zero = match reference {
        None => Zero::default(),
        Some(folder) => Zero::of(&bare, rig).ok_or_else(|| {
            no_bed(
                folder,
                empty.len(),
                "no stripe there, or pictures of another setup",
                "give pictures of the empty bed, taken like the others, or omit --reference",
            )
        })?,
    };
    let mut report = ShiftReport {
        rig: rig.clone(),
        pictures: names.len(),
        points: 0,
        without_bed: vec![],
        reference: empty.len(),
        bed_noise_mm: f64::NAN,
        plateau: None,
        remarks: gaps(&names, rig.travel_mm).into_iter().collect(),
    };
    let (mut cloud, mut lines) = (Vec::new(), Vec::new());
    for (i, path) in names.iter().enumerate() {
        let (crossings, image) = rows(path, &mut alike)?;
        alike.differs(path, &image)?;
        lines.push((name(path), bed_line(&crossings, rig)));
        let found = points(&crossings, i as u32, rig, &zero);
        if found.is_empty() {
            report.without_bed.push(name(path));
        }
        cloud.extend(found);
    }
    if report.without_bed.len() == names.len() {
        return Err(no_bed(
            folder,
            names.len(),
            "--bed-rows names other rows, the stripe runs along the rows, or it is too faint in this channel",
            "look at a picture, and give rows in which the stripe lies on the bare bed, or another --channel",
        ));
    }
    report.remarks.extend(alike.remark(rig.travel_mm));
    report.remarks.extend(beds(&lines, rig.bed_span(), alike.size())?);
    report.points = cloud.len();
    let on_bed = |p: &CloudPoint| rig.is_bed(f64::from(p.v));
    let bed: Vec<f64> = cloud.iter().filter(|p| on_bed(p)).map(|p| f64::from(p.position[2])).collect();
    report.bed_noise_mm = spread(&bed).1;
    let off: Vec<CloudPoint> = cloud.iter().filter(|p| !on_bed(p)).copied().collect();
    report.remarks.extend(below(&off, &lines.into_iter().map(|(name, _)| name).collect::<Vec<_>>()));
    let high = |p: &&CloudPoint| !on_bed(p) && f64::from(p.position[2]) > min_height_mm;
    report.plateau = plateau(&cloud.iter().filter(high).copied().collect::<Vec<_>>());
    Ok((report, cloud))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::Image;

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
            let found = points(&stripe_by_row(&picture(shift)), 3, &rig(), &Zero::default());
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

    /// A bent stripe: without a reference its bend appears as height.
    #[test]
    fn a_reference_takes_out_how_the_stripe_is_bent() {
        let bent = |shift: f64| -> Vec<Option<Crossing>> {
            let at = |v: usize| {
                let bend = 3.0 * ((v as f64 - 150.0) / 150.0).powi(2);
                let u = 260.0 + bend - if (100..200).contains(&v) { shift } else { 0.0 };
                // Some rows are never visible.
                (v % 10 != 3).then_some(Crossing { u, sigma_px: 0.1, amplitude: 100.0, saturated: false })
            };
            (0..300).map(at).collect()
        };
        let zero = Zero::of(&[bent(0.0), bent(0.0), bent(0.0)], &rig()).unwrap();
        let (want, _) = rig().height(20.0);
        let off = |zero: &Zero| {
            let found = points(&bent(20.0), 0, &rig(), zero);
            let on = found.iter().filter(|p| (100.0..200.0).contains(&p.v));
            on.map(|p| (f64::from(p.position[2]) - want).abs()).fold(0.0, f64::max)
        };
        assert!(off(&zero) < 0.01 && off(&Zero::default()) > 0.2, "{} {}", off(&zero), off(&Zero::default()));
        assert!(Zero::of(&[vec![None; 300]], &rig()).is_none());
    }

    #[test]
    fn pictures_that_do_not_go_together_are_refused_by_name() {
        let scan = |fill: &dyn Fn(&Path)| {
            let dir = tempfile::tempdir().unwrap();
            for k in 0..12u32 {
                // A stripe that widens makes each picture another one.
                let image = picture(if k > 5 { 30.0 + f64::from(k) } else { f64::from(k) * 0.3 });
                crate::raster::save_png(&image, &dir.path().join(format!("f{k:02}.png"))).unwrap();
            }
            fill(dir.path());
            let rig = ShiftRig { bed_rows: vec![[5, 60], [240, 290]], ..rig() };
            shift_scan(dir.path(), None, &rig, 1.0, &mut |_, _| {}).map(|(report, _)| report)
        };
        let plain = scan(&|_| {}).unwrap();
        assert!(plain.remarks.is_empty() && plain.points > 1000, "{:?}", plain.remarks);
        let at = |dir: &Path, k: u32| dir.join(format!("f{k:02}.png"));
        let half = |dir: &Path| {
            let small = Image::from_u8(200, 150, vec![9; 200 * 150]);
            crate::raster::save_png(&small, &at(dir, 8)).unwrap();
        };
        assert!(scan(&half).unwrap_err().what.contains("f08.png: is 200x150, f00.png is 400x300"));
        let webp = |dir: &Path| std::fs::rename(at(dir, 8), dir.join("f08.webp")).unwrap();
        assert!(scan(&webp).unwrap_err().what.contains("f08.webp: is a picture of a format that is not read"));
        let copy = |dir: &Path| {
            std::fs::copy(at(dir, 3), dir.join("f03 (1).png")).unwrap();
        };
        assert!(scan(&copy).unwrap_err().what.contains("holds the same picture as"));
        let both = |dir: &Path| {
            std::fs::copy(at(dir, 3), dir.join("f03.bmp")).unwrap();
        };
        assert!(scan(&both).unwrap_err().cause.contains("two formats"));
        let mirrored = |dir: &Path| {
            let image = picture(38.0);
            let level = |i: u32| image.get(399 - i % 400, i / 400) as u8;
            let other = Image::from_u8(400, 300, (0..400 * 300).map(level).collect());
            crate::raster::save_png(&other, &at(dir, 8)).unwrap();
        };
        assert!(scan(&mirrored).unwrap_err().what.contains("f08.png: shows the bed's stripe"));
        let lost = |dir: &Path| std::fs::remove_file(at(dir, 8)).unwrap();
        assert!(scan(&lost).unwrap().remarks[0].contains("f07.png and f09.png"));
        let black = |dir: &Path| {
            let image = Image::from_u8(400, 300, vec![9; 400 * 300]);
            (0..12).for_each(|k| crate::raster::save_png(&image, &at(dir, k)).unwrap());
        };
        assert!(scan(&black).unwrap_err().what.contains("0 of 12 pictures show the bed"));
        let dir = tempfile::tempdir().unwrap();
        crate::raster::save_png(&picture(0.0), &at(dir.path(), 0)).unwrap();
        let below = ShiftRig { bed_rows: vec![[600, 700]], ..rig() };
        let fault = shift_scan(dir.path(), None, &below, 1.0, &mut |_, _| {}).unwrap_err();
        assert!(fault.what.contains("bed rows 600..700: the pictures have the rows 0..299"), "{fault}");
        let other = ShiftRig { raises: Side::Right, ..rig() };
        crate::raster::save_png(&picture(40.0), &at(dir.path(), 0)).unwrap();
        let report = shift_scan(dir.path(), None, &other, 1.0, &mut |_, _| {}).unwrap().0;
        assert!(report.remarks[0].contains("more below the bed than above it"), "{:?}", report.remarks);
    }

    #[test]
    fn senseless_rigs_are_refused() {
        assert!(ShiftRig { pixels_per_mm: 0.0, ..rig() }.check().is_err());
        assert!(ShiftRig { bed_rows: vec![[40, 5]], ..rig() }.check().is_err());
        let dir = tempfile::tempdir().unwrap();
        assert!(shift_scan(dir.path(), None, &rig(), 1.0, &mut |_, _| {}).unwrap_err().what.contains("no pictures"));
    }
}
