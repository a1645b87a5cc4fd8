//! In: the points of an entry and the exact lines of the pictures. Out: how many lie on the lines, how far from them,
//! and how much of the lines was found. Frame and unit: px across the line, mm in the camera frame.

use super::result::Accuracy;
use super::scene::{Line, Task};
use super::wire::Found;
use sheetlight::geometry::Vec3;

/// A point farther than this from every line is false, px.
pub(super) const FALSE_PX: f64 = 3.0;
/// Smaller standard deviations are no statement, px; nor are those beyond the limit of a false point.
const MOST_SURE: f64 = 1e-4;
/// A column of a line is found if a point lies this near across the line, px.
const FOUND_PX: f64 = 1.0;
/// And this near along it: points of one a pixel are up to a pixel and a half apart on a slanted line.
const BESIDE_PX: f64 = 0.75;

/// Sums over the pictures of a task.
#[derive(Default)]
pub(super) struct Score {
    pictures: u64,
    points: u64,
    false_points: u64,
    columns: u64,
    columns_found: u64,
    /// Mean square distances of the columns that have points, px squared and mm squared.
    px2: Vec<f64>,
    mm2: f64,
    stated: u64,
    beyond_three_sigma: u64,
}

/// The points at one column of a line.
#[derive(Clone, Copy, Default)]
struct Column {
    points: f64,
    found: bool,
    px2: f64,
    mm2: f64,
}

/// The foot of a point on a line: its column, and the signed distance, px.
fn foot(line: &Line, p: &Found) -> Option<(f64, f64)> {
    let (u, v) = (f64::from(p.u), f64::from(p.v));
    let slope = line.slope(u);
    let across = 1.0 / (1.0 + slope * slope).sqrt();
    let off = (v - line.row(u)) * across;
    let at = u + off * slope * across;
    (at >= line.from - 1.0 && at <= line.to + 1.0 && off.is_finite()).then_some((at, off))
}

impl Score {
    /// Adds the points of picture `number`.
    pub fn add(&mut self, task: &Task, number: u32, points: &[Found]) {
        let lines = task.lines(number);
        let mut columns: Vec<Vec<Column>> =
            lines.iter().map(|l| vec![Column::default(); (l.to - l.from) as usize + 1]).collect();
        self.pictures += 1;
        for p in points {
            self.points += 1;
            let feet = lines.iter().enumerate().filter_map(|(i, line)| Some((i, foot(line, p)?)));
            let nearest = feet.min_by(|a, b| a.1.1.abs().total_cmp(&b.1.1.abs()));
            let Some((i, (at, off))) = nearest.filter(|(_, (_, off))| off.abs() <= FALSE_PX) else {
                self.false_points += 1;
                continue;
            };
            // A column counts once, however many points it has: copies of a good one change nothing.
            let along = at - lines[i].from;
            let last = columns[i].len() as f64 - 1.0;
            if off.abs() <= FOUND_PX {
                let [from, to] = [along - BESIDE_PX, along + BESIDE_PX].map(|a| a.clamp(0.0, last));
                columns[i][from.ceil() as usize..=to.floor() as usize].iter_mut().for_each(|c| c.found = true);
            }
            let column = &mut columns[i][along.round().clamp(0.0, last) as usize];
            let xyz = Vec3::from(p.xyz.map(f64::from));
            // A point that is no number counts as a metre away.
            let mm = task.point(at, lines[i].row(at)).map_or(0.0, |truth| (xyz - truth).norm());
            column.points += 1.0;
            column.px2 += off * off;
            column.mm2 += if mm.is_finite() { (mm * mm).min(1e6) } else { 1e6 };
            if (MOST_SURE..=FALSE_PX).contains(&f64::from(p.sigma_px)) {
                self.stated += 1;
                self.beyond_three_sigma += u64::from(off.abs() > 3.0 * f64::from(p.sigma_px));
            }
        }
        for column in columns.iter().flatten() {
            self.columns += 1;
            self.columns_found += u64::from(column.found);
            if column.points > 0.0 {
                self.px2.push(column.px2 / column.points);
                self.mm2 += column.mm2 / column.points;
            }
        }
    }

    /// The figures.
    pub fn accuracy(&self) -> Accuracy {
        let share = |part: u64, of: u64| if of == 0 { None } else { Some(part as f64 / of as f64) };
        let on_line = self.px2.len() as f64;
        let mut squares = self.px2.clone();
        squares.sort_by(f64::total_cmp);
        let rms = (squares.iter().sum::<f64>() / on_line).sqrt();
        Accuracy {
            points_a_picture: self.points as f64 / self.pictures.max(1) as f64,
            found: share(self.columns_found, self.columns),
            false_share: share(self.false_points, self.false_points + self.px2.len() as u64),
            false_a_picture: self.false_points as f64 / self.pictures.max(1) as f64,
            median_px: squares.get(squares.len() / 2).map(|e2| e2.sqrt()),
            rms_px: (on_line > 0.0).then_some(rms),
            rms_mm: (on_line > 0.0).then(|| (self.mm2 / on_line).sqrt()),
            beyond_three_sigma: share(self.beyond_three_sigma, self.stated),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::scene::SceneKind;
    use super::*;

    /// Points `off` px across the line, one a column, with the exact X, Y, Z of that place.
    fn points(task: &Task, number: u32, off: f64) -> Vec<Found> {
        let lines = task.lines(number);
        let columns = lines.iter().flat_map(|l| (l.from as u32..=l.to as u32).map(move |x| (*l, f64::from(x))));
        columns
            .map(|(line, u)| {
                let slope = line.slope(u);
                let across = 1.0 / (1.0 + slope * slope).sqrt();
                let (pu, pv) = (u - off * slope * across, line.row(u) + off * across);
                let xyz = task.point(pu, pv).unwrap().map(|x| x as f32);
                Found { u: pu as f32, v: pv as f32, sigma_px: 0.1, xyz: xyz.into() }
            })
            .collect()
    }

    fn scored(task: &Task, points: &[Found]) -> Accuracy {
        let mut score = Score::default();
        score.add(task, 0, points);
        score.accuracy()
    }

    #[test]
    fn the_error_across_the_line_is_measured_lying_and_slanted() {
        for scene in [SceneKind::Clean, SceneKind::Slanted, SceneKind::TwoStripes] {
            let task = Task { scene, width: 640, height: 480, bits: 8 };
            let exact = scored(&task, &points(&task, 0, 0.0));
            assert!(exact.rms_px.unwrap() < 1e-4 && exact.rms_mm.unwrap() < 1e-3, "{exact:?}");
            assert_eq!((exact.found, exact.false_share), (Some(1.0), Some(0.0)));
            let off = scored(&task, &points(&task, 0, 0.2));
            assert!((off.rms_px.unwrap() - 0.2).abs() < 0.002, "{scene:?} {off:?}");
            assert!((off.median_px.unwrap() - 0.2).abs() < 0.002);
            // 0.2 px at 60 to 300 mm and f = 614 px, stretched by the plane's slope.
            assert!((0.02..0.4).contains(&off.rms_mm.unwrap()), "{off:?}");
            assert_eq!(off.beyond_three_sigma, Some(0.0));
            assert_eq!(scored(&task, &points(&task, 0, 0.4)).beyond_three_sigma, Some(1.0));
        }
    }

    #[test]
    fn what_lies_elsewhere_is_false_and_what_is_missing_lowers_the_share_found() {
        let task = Task::example(640, 480, 8);
        let mut some = points(&task, 0, 0.0);
        let all = some.len();
        some.truncate(all / 2);
        let half = scored(&task, &some);
        assert!((half.found.unwrap() - 0.5).abs() < 0.01, "{half:?}");
        some.iter_mut().for_each(|p| p.v += 5.0);
        let away = scored(&task, &some);
        assert_eq!((away.found, away.false_share, away.rms_px), (Some(0.0), Some(1.0), None));
        // Between the points of one a pixel of a slanted line no column is missed, between those of every third one is.
        let slanted = Task { scene: SceneKind::Slanted, ..task };
        let mut apart = points(&slanted, 0, 0.0);
        apart.iter_mut().enumerate().for_each(|(i, p)| {
            let by = if i % 2 == 0 { 0.4 } else { 0.6 };
            (p.u, p.v) = (p.u + by, p.v + by * slanted.lines(0)[0].slope(f64::from(p.u)) as f32);
        });
        assert_eq!(scored(&slanted, &apart).found, Some(1.0));
        let thin: Vec<Found> = points(&slanted, 0, 0.0).into_iter().step_by(3).collect();
        assert!((scored(&slanted, &thin).found.unwrap() - 1.0 / 3.0).abs() < 0.01);
        // Points that are off by 1.5 px are no longer "found", and not yet false.
        let near = scored(&task, &points(&task, 0, 1.5));
        assert_eq!((near.found, near.false_share), (Some(0.0), Some(0.0)));
        // Copies of one point, good or bad, change nothing.
        let mut copies = points(&task, 0, 0.2);
        let once = scored(&task, &copies);
        copies.extend(vec![copies[7]; 20_000]);
        let often = scored(&task, &copies);
        assert!((often.rms_px.unwrap() - once.rms_px.unwrap()).abs() < 1e-9 && often.found == once.found);
        let nan = Found { u: f32::NAN, v: 1.0, sigma_px: 0.1, xyz: [f32::NAN; 3] };
        assert_eq!(scored(&task, &[nan]).false_share, Some(1.0));
        let mut lost = points(&task, 0, 0.0);
        lost[3].xyz = [f32::NAN; 3];
        assert!(scored(&task, &lost).rms_mm.unwrap() > 30.0);
        let mut sure = points(&task, 0, 0.2);
        sure.iter_mut().for_each(|p| p.sigma_px = 1e9);
        assert_eq!(scored(&task, &sure).beyond_three_sigma, None);
        let dark = Task { scene: SceneKind::Dark, ..task };
        let nothing = scored(&dark, &points(&task, 0, 0.0));
        assert_eq!((nothing.found, nothing.false_share, nothing.false_a_picture), (None, Some(1.0), all as f64));
    }
}
