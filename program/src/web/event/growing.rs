//! In: the profiles of a running scan. Out: its growing height map: one row per shot (or per few shots), one column
//! per piece of the stripe.
//! Frame and unit: heights towards the camera at the first shot, mm; rows in the order of the shots.

use sheetlight::geometry::Vec3;
use sheetlight::scan::Profile;
use std::sync::Mutex;

/// Number of columns along the stripe.
const COLUMNS: usize = 384;
/// Most rows; in a longer scan a row combines several shots.
const MOST_ROWS: usize = 1024;
/// First word of a message: "GROW".
const MAGIC: u32 = u32::from_le_bytes(*b"GROW");

/// The growing height map.
#[derive(Default)]
pub struct Growing(Mutex<Rows>);

#[derive(Default)]
struct Rows {
    job: u32,
    /// Shots per row.
    every: usize,
    total: usize,
    done: usize,
    /// Whether the stripe runs along v, and its range in the picture, from, to, px.
    stripe: Option<(bool, f32, f32)>,
    heights: Vec<f32>,
    counts: Vec<u32>,
}

impl Growing {
    /// Starts the map of a job with this number of shots.
    pub fn begin(&self, job: u32, shots: usize) {
        let every = shots.div_ceil(MOST_ROWS).max(1);
        let rows = shots.div_ceil(every);
        *self.rows() = Rows {
            job,
            every,
            total: rows,
            heights: vec![0.0; rows * COLUMNS],
            counts: vec![0; rows * COLUMNS],
            ..Rows::default()
        };
    }

    fn rows(&self) -> std::sync::MutexGuard<'_, Rows> {
        self.0.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Adds a shot; `size` is the size of the pictures, px.
    pub fn add(&self, profile: &Profile, up: &Vec3, size: [u32; 2]) {
        let mut rows = self.rows();
        let row = profile.shot as usize / rows.every.max(1);
        if row >= rows.total {
            return;
        }
        rows.done = rows.done.max(row + 1);
        // Columns follow the side of the picture along which the first good stripe is longer.
        if rows.stripe.is_none() && profile.points.len() > 20 {
            let span = |f: &dyn Fn(usize) -> f32| {
                let values = (0..profile.points.len()).map(f);
                values.fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)))
            };
            let (u, v) = (span(&|i| profile.points[i].u), span(&|i| profile.points[i].v));
            let upright = v.1 - v.0 > u.1 - u.0;
            rows.stripe = Some((upright, 0.0, size[usize::from(upright)] as f32));
        }
        let Some((upright, from, to)) = rows.stripe else { return };
        for p in &profile.points {
            let at = (if upright { p.v } else { p.u } - from) / (to - from) * COLUMNS as f32;
            let cell = row * COLUMNS + (at.max(0.0) as usize).min(COLUMNS - 1);
            let place = Vec3::new(p.position[0].into(), p.position[1].into(), p.position[2].into());
            rows.heights[cell] += place.dot(up) as f32;
            rows.counts[cell] += 1;
        }
    }

    /// The job of the map, and its number of rows so far.
    pub fn at(&self) -> (u32, usize) {
        let rows = self.rows();
        (rows.job, rows.done)
    }

    /// Rows from `from` on, little endian: "GROW", job, columns, total rows, first row, number of rows, then the
    /// heights as floats, NaN if nothing was measured. `None` if there is no new row.
    pub fn message(&self, from: usize) -> Option<Vec<u8>> {
        let rows = self.rows();
        if rows.done <= from {
            return None;
        }
        let head = [MAGIC, rows.job, COLUMNS as u32, rows.total as u32, from as u32, (rows.done - from) as u32];
        let mut bytes: Vec<u8> = head.iter().flat_map(|w| w.to_le_bytes()).collect();
        for cell in from * COLUMNS..rows.done * COLUMNS {
            let z = if rows.counts[cell] > 0 { rows.heights[cell] / rows.counts[cell] as f32 } else { f32::NAN };
            bytes.extend(z.to_le_bytes());
        }
        Some(bytes)
    }
}
