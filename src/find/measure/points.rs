//! In: a cloud and its shots. Out: its points in the order of the sensor: one row for each shot, one column for each
//! pixel along the stripe. Neighbours along the stripe and in the next shot are thus known.
//! Frame and unit: base frame, mm.

use super::options::MeasureOptions;
use super::robust::median;
use crate::fault::{Fault, Result};
use crate::find::model::drawing::Drawing;
use crate::geometry::{Base, Camera, Part, Rigid, Vec3};
use crate::scan::{Along, CloudPoint, Shots};

const NONE: u32 = u32::MAX;

/// Points by shot and column.
pub struct Ordered {
    /// Place of each point in the cloud's frame, mm.
    pub points: Vec<Vec3>,
    /// Stripe amplitude of each point, grey levels.
    pub intensity: Vec<f32>,
    /// Standard deviation of each point along its worst direction, mm.
    pub sigma: Vec<f32>,
    /// Row (existing shots, ascending) and column of each point.
    pub row: Vec<u32>,
    /// Pixel along the stripe, counted from the first that any shot reached.
    pub column: Vec<u32>,
    /// Axis of the picture along which columns are counted.
    pub along: Along,
    /// Shot number of each row.
    pub shot: Vec<u32>,
    /// Camera pose at each row's shot; `None` where it is unknown.
    pub from_camera: Vec<Option<Rigid<Base, Camera>>>,
    /// Pixel (u, v) of each point.
    pub pixel: Vec<[f32; 2]>,
    /// Length along a surface of the light that a point was measured from, mm; 0 where the stripe's width is unknown.
    pub reach_mm: f64,
    columns: usize,
    index: Vec<u32>,
}

/// A cloud with fewer points holds no part.
pub const MIN_POINTS: usize = 500;
/// More than the width of any sensor, px.
const FARTHEST_PX: f32 = 131_072.0;

impl Ordered {
    /// Sorts a cloud. Of several points in one pixel column of a shot, the strongest is used.
    ///
    /// # Errors
    /// A cloud that is too small, damaged, or has shots that are not listed.
    pub fn new(cloud: &[CloudPoint], shots: &Shots) -> Result<Ordered> {
        whole(cloud)?;
        let mut shot: Vec<u32> = cloud.iter().map(|p| p.shot).collect();
        shot.sort_unstable();
        shot.dedup();
        let from_camera = places(&shot, shots)?;
        let table = Table::of(cloud, &shot, shots.along)?;
        let mut ordered = Ordered::filled(cloud, table, shots.along, shot, from_camera);
        ordered.reach_mm = shots.stripe_px.map_or(0.0, |width| ordered.reach(width));
        Ok(ordered)
    }

    /// The points of a table in its order; its indices into the cloud become indices into these points.
    fn filled(
        cloud: &[CloudPoint],
        Table { columns, mut index }: Table,
        along: Along,
        shot: Vec<u32>,
        from_camera: Vec<Option<Rigid<Base, Camera>>>,
    ) -> Ordered {
        let mut out = Ordered {
            points: vec![],
            intensity: vec![],
            sigma: vec![],
            row: vec![],
            column: vec![],
            along,
            pixel: vec![],
            reach_mm: 0.0,
            shot,
            from_camera,
            columns,
            index: vec![],
        };
        for (slot, i) in index.iter_mut().enumerate() {
            if *i != NONE {
                let p = &cloud[*i as usize];
                *i = out.points.len() as u32;
                out.points.push(p.at());
                out.intensity.push(p.intensity);
                out.sigma.push(p.sigma_mm);
                out.row.push((slot / columns) as u32);
                out.column.push((slot % columns) as u32);
                out.pixel.push([p.u, p.v]);
            }
        }
        out.index = index;
        out
    }

    /// Two widths of the stripe, in mm by the median step between neighbours along it. For a slanted stripe it is
    /// longer by the extra reach of profiles along an image axis.
    fn reach(&self, stripe_px: f32) -> f64 {
        let across = |i: usize| self.pixel[i][usize::from(self.along == Along::U)];
        let beside = |i: usize| self.at(i64::from(self.row[i]), i64::from(self.column[i]) + 1);
        let pairs: Vec<(usize, usize)> = (0..self.points.len()).filter_map(|i| Some((i, beside(i)?))).collect();
        let step = median(pairs.iter().map(|&(i, j)| (self.points[j] - self.points[i]).norm()).collect());
        let lean = median(pairs.iter().map(|&(i, j)| f64::from(across(j) - across(i)).abs()).collect());
        2.0 * (1.0 + lean) * f64::from(stripe_px) * step / 1.0f64.hypot(lean)
    }

    /// The point in a row and column, if there is one.
    pub fn at(&self, row: i64, column: i64) -> Option<usize> {
        if row < 0 || column < 0 || row >= self.shot.len() as i64 || column >= self.columns as i64 {
            return None;
        }
        let i = self.index[row as usize * self.columns + column as usize];
        (i != NONE).then_some(i as usize)
    }

    /// The points of one row.
    pub fn in_row(&self, row: u32) -> std::ops::Range<usize> {
        self.row.partition_point(|&r| r < row)..self.row.partition_point(|&r| r <= row)
    }

    /// True where `column` lies within the columns that any shot reached, so that an empty place there means that no
    /// light was seen.
    pub fn covers(&self, row: i64, column: i64) -> bool {
        row >= 0 && row < self.shot.len() as i64 && column >= 0 && column < self.columns as i64
    }
}

/// Refuses a cloud that is too small, or that holds values which no scan writes.
fn whole(cloud: &[CloudPoint]) -> Result<()> {
    if cloud.len() < MIN_POINTS {
        return Err(Fault::refused(format!("the scan has {} points, at least {MIN_POINTS} are needed", cloud.len()))
            .cause("an empty or tiny scan: no laser in the pictures, or a few shots only")
            .next("look at the scan's report, then scan the part again"));
    }
    let bad = |p: &&CloudPoint| !p.position.is_finite() || !(p.u.abs() + p.v.abs() < FARTHEST_PX);
    if let Some(p) = cloud.iter().find(bad) {
        let ([x, y, z], u, v) = (p.position.to_array(), p.u, p.v);
        return Err(Fault::input(format!(
            "the cloud holds the point ({x}, {y}, {z}) of pixel ({u}, {v}) in shot {}; wanted finite mm, and pixels \
             below {FARTHEST_PX}",
            p.shot
        ))
        .cause("the cloud was damaged, or not written by sheetlight scan")
        .next("scan again"));
    }
    Ok(())
}

/// The camera's pose at each shot: known for all of them, or for none.
fn places(shot: &[u32], shots: &Shots) -> Result<Vec<Option<Rigid<Base, Camera>>>> {
    let from_camera: Vec<_> = shot.iter().map(|s| shots.place(*s).copied()).collect();
    if let Some(i) = from_camera.iter().position(Option::is_none)
        && from_camera.iter().any(Option::is_some)
    {
        return Err(Fault::input(format!("the cloud holds points of shot {}, which is not listed", shot[i]))
            .cause("the cloud and the list of shots are of two scans")
            .next("scan again"));
    }
    Ok(from_camera)
}

/// A cloud's points by row and column: index into the cloud, or [`NONE`].
struct Table {
    columns: usize,
    index: Vec<u32>,
}

impl Table {
    fn of(cloud: &[CloudPoint], shot: &[u32], along: Along) -> Result<Table> {
        let along: fn(&CloudPoint) -> f32 = match along {
            Along::U => |p| p.u,
            Along::V => |p| p.v,
        };
        let first = cloud.iter().map(along).fold(f32::MAX, f32::min).round();
        let last = cloud.iter().map(along).fold(f32::MIN, f32::max).round();
        let columns = (last - first) as usize + 1;
        if columns > 1 << 16 || columns.saturating_mul(shot.len()) > 1 << 28 {
            return Err(Fault::input(format!("the cloud spans {columns} pixel columns in {} shots", shot.len()))
                .cause("the cloud was not written by sheetlight scan")
                .next("scan again"));
        }
        let mut index = vec![NONE; columns * shot.len()];
        for (i, p) in cloud.iter().enumerate() {
            let r = shot.binary_search(&p.shot).expect("listed above");
            let slot = &mut index[r * columns + (along(p).round() - first) as usize];
            if *slot == NONE || cloud[*slot as usize].intensity < p.intensity {
                *slot = i as u32;
            }
        }
        Ok(Table { columns, index })
    }
}

/// Points at and around the part, in the part frame; `None` for all others.
pub fn localise(
    points: &Ordered,
    drawing: &Drawing,
    pose: &Rigid<Base, Part>,
    options: &MeasureOptions,
) -> Vec<Option<Vec3>> {
    let (b, r) = (drawing.bounds(), 3.0 * options.unit());
    let part_from_base = pose.inverse();
    points
        .points
        .iter()
        .map(|p| {
            let q = part_from_base.point(p);
            let near = q.x > b[0] - r && q.x < b[2] + r && q.y > b[1] - r && q.y < b[3] + r;
            near.then_some(q)
        })
        .collect()
}
