//! In: a lattice of corners, some of them missing or wrong. Out: the corners that belong to one board: wrong ones
//! dropped, missing ones predicted from their neighbours and verified in the picture.
//! Frame and unit: pixels; labels as in the lattice.

use super::grid::Grid;
use crate::calibrate::boards::refine::{Corner, Grey, Window};

/// Refines the corners found, then extends the lattice to corners that the detector missed, as long as the picture
/// shows a corner of the same contrast, polarity and blur there. The lattice is updated.
pub fn grown(grid: &mut Grid, grey: &Grey, window: &Window, band_px: f64) -> Vec<Option<Corner>> {
    let mut corners = grid.refined(grey, window, band_px);
    // A round adds one row or column on each side.
    for _ in 0..grid.columns + grid.rows {
        let Some(typical) = Typical::of(&corners, grid.columns) else { break };
        for (k, c) in corners.iter_mut().enumerate() {
            if c.is_some_and(|c| !typical.resembles(&c, k % grid.columns + k / grid.columns)) {
                *c = None;
            }
        }
        corners.iter().zip(&mut grid.corners).for_each(|(c, g)| *g = c.map(|c| c.pixel));
        let known = grid.count();
        let missing = grid.predicted();
        let mut larger = grid.clone();
        missing.iter().for_each(|(k, p)| larger.corners[*k] = Some(*p));
        let all = larger.refined(grey, window, band_px);
        for (k, _) in missing {
            let new = all[k].filter(|c| typical.resembles(c, k % grid.columns + k / grid.columns));
            corners[k] = new;
            grid.corners[k] = new.map(|c| c.pixel);
        }
        if grid.count() == known {
            break;
        }
    }
    corners
}

/// Median properties of this picture's corners.
struct Typical {
    contrast: f64,
    blur: f64,
    sigma: f64,
}

impl Typical {
    fn of(corners: &[Option<Corner>], columns: usize) -> Option<Typical> {
        let median = |f: &dyn Fn(usize, &Corner) -> f64| {
            let mut v: Vec<f64> = corners.iter().enumerate().filter_map(|(k, c)| c.as_ref().map(|c| f(k, c))).collect();
            v.sort_by(f64::total_cmp);
            v.get(v.len() / 2).copied()
        };
        Some(Typical {
            contrast: median(&|k, c| c.contrast * sign(k % columns + k / columns))?,
            blur: median(&|_, c| c.blur_px)?,
            sigma: median(&|_, c| c.sigma_px)?,
        })
    }
    fn resembles(&self, c: &Corner, parity: usize) -> bool {
        let contrast = c.contrast * sign(parity) / self.contrast;
        (0.3..3.0).contains(&contrast) && c.blur_px < 2.5 * self.blur + 0.5 && c.sigma_px < 5.0 * self.sigma + 0.02
    }
}

fn sign(parity: usize) -> f64 {
    if parity.is_multiple_of(2) { 1.0 } else { -1.0 }
}
