//! In: a height map and filters in their order. Out: the same map without the cells that the filters remove. A
//! filter only removes cells; the others keep their measured values.
//! Frame and unit: grid frame, mm from the grid's corner; heights above the grid's plane.

use super::heightmap::HeightMap;
use crate::fault::{Fault, Result};

/// Which cells a filter removes.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(tag = "filter", rename_all = "snake_case", deny_unknown_fields)]
pub enum Filter {
    /// Cells whose stated standard deviation exceeds a limit.
    Sigma {
        /// mm, > 0.
        most_mm: f64,
    },
    /// Cells outside a range of heights.
    Heights {
        /// mm.
        low_mm: f64,
        /// mm, > low.
        high_mm: f64,
    },
    /// Cells inside a box.
    Cut {
        /// Two opposite corners: x0 y0 x1 y1, mm.
        corners: [f64; 4],
    },
    /// Cells outside a box.
    Keep {
        /// Two opposite corners: x0 y0 x1 y1, mm.
        corners: [f64; 4],
    },
    /// Pieces of surface with few cells: glints, dust, light through a hole. A piece ends at a step.
    Islands {
        /// Pieces with fewer cells are removed, 2 to 1 000 000.
        least_cells: u32,
        /// Neighbours that differ by more than this belong to different pieces, mm, > 0.
        step_mm: f64,
    },
}

/// Most filters of one map.
pub const MOST_FILTERS: usize = 64;
const MOST_CELLS: u32 = 1_000_000;

impl Filter {
    /// Refuses numbers out of range.
    pub fn check(&self) -> Result<()> {
        let finite = |v: &[f64]| v.iter().all(|v| v.is_finite());
        let wrong = match self {
            Filter::Sigma { most_mm } if !(*most_mm > 0.0 && most_mm.is_finite()) => {
                format!("sigma: {most_mm} mm, wanted more than 0")
            }
            Filter::Heights { low_mm, high_mm } if !(finite(&[*low_mm, *high_mm]) && low_mm < high_mm) => {
                format!("heights: from {low_mm} to {high_mm} mm, wanted a lower and a higher one")
            }
            Filter::Cut { corners: c } | Filter::Keep { corners: c }
                if !(finite(c) && c[0] != c[2] && c[1] != c[3]) =>
            {
                format!("box: corners {c:?}, wanted two opposite ones, mm")
            }
            Filter::Islands { least_cells, step_mm }
                if !((2..=MOST_CELLS).contains(least_cells) && *step_mm > 0.0 && step_mm.is_finite()) =>
            {
                format!(
                    "islands: {least_cells} cells, step {step_mm} mm; wanted 2 to {MOST_CELLS} cells, a step above 0"
                )
            }
            _ => return Ok(()),
        };
        Err(Fault::usage(wrong).next("correct the filter"))
    }

    /// Removes cells and returns their number.
    pub fn apply(&self, map: &mut HeightMap) -> usize {
        let goes: Vec<bool> = match self {
            Filter::Sigma { most_mm } => map.sigma.iter().map(|s| f64::from(*s) > *most_mm).collect(),
            Filter::Heights { low_mm, high_mm } => {
                map.z.iter().map(|z| !(*low_mm..=*high_mm).contains(&f64::from(*z))).collect()
            }
            Filter::Cut { corners } => inside(map, corners),
            Filter::Keep { corners } => inside(map, corners).into_iter().map(|i| !i).collect(),
            Filter::Islands { least_cells, step_mm } => small(map, *least_cells as usize, *step_mm as f32),
        };
        let mut taken = 0;
        for (i, _) in goes.iter().enumerate().filter(|(_, goes)| **goes) {
            taken += usize::from(map.z[i].is_finite());
            (map.z[i], map.intensity[i], map.sigma[i], map.count[i]) = (f32::NAN, f32::NAN, f32::NAN, 0);
        }
        taken
    }
}

/// `sigma:0.05`, `heights:-1,4`, `cut:10,10,20,20`, `keep:0,0,50,30`, `islands:20,0.5`: lengths in mm; islands take
/// the number of cells first.
impl std::str::FromStr for Filter {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Filter, String> {
        let (name, rest) = text.split_once(':').unwrap_or((text, ""));
        let numbers: Option<Vec<f64>> = rest.split(',').map(|v| v.trim().parse().ok()).collect();
        let filter = match (name, numbers.as_deref()) {
            ("sigma", Some([mm])) => Filter::Sigma { most_mm: *mm },
            ("heights", Some([low, high])) => Filter::Heights { low_mm: *low, high_mm: *high },
            ("cut", Some([a, b, c, d])) => Filter::Cut { corners: [*a, *b, *c, *d] },
            ("keep", Some([a, b, c, d])) => Filter::Keep { corners: [*a, *b, *c, *d] },
            ("islands", Some([n, step])) if n.fract() == 0.0 && (0.0..1e9).contains(n) => {
                Filter::Islands { least_cells: *n as u32, step_mm: *step }
            }
            _ => {
                return Err(format!(
                    "'{text}' is not a filter: sigma:MM, heights:LOW,HIGH, cut:X0,Y0,X1,Y1, keep:X0,Y0,X1,Y1 or \
                     islands:CELLS,STEP"
                ));
            }
        };
        filter.check().map_err(|fault| fault.what).map(|()| filter)
    }
}

/// The cells whose centres lie in a box.
fn inside(map: &HeightMap, c: &[f64; 4]) -> Vec<bool> {
    let within = |i: u32, a: f64, b: f64| (a.min(b)..=a.max(b)).contains(&((f64::from(i) + 0.5) * map.cell));
    let columns: Vec<bool> = (0..map.width).map(|x| within(x, c[0], c[2])).collect();
    (0..map.height).flat_map(|y| columns.iter().map(move |x| *x && within(y, c[1], c[3]))).collect()
}

/// The cells of pieces with fewer than `least` cells. A piece consists of neighbours, also across corners, that
/// differ by no more than `step`.
fn small(map: &HeightMap, least: usize, step: f32) -> Vec<bool> {
    let (w, h) = (map.width as usize, map.height as usize);
    let (mut seen, mut goes) = (vec![false; map.z.len()], vec![false; map.z.len()]);
    let (mut piece, mut open) = (Vec::new(), Vec::new());
    for first in 0..map.z.len() {
        if seen[first] || !map.z[first].is_finite() {
            continue;
        }
        seen[first] = true;
        piece.clear();
        open.push(first);
        while let Some(i) = open.pop() {
            piece.push(i);
            let (x, y) = (i % w, i / w);
            for ny in y.saturating_sub(1)..=(y + 1).min(h - 1) {
                for nx in x.saturating_sub(1)..=(x + 1).min(w - 1) {
                    let n = ny * w + nx;
                    if !seen[n] && (map.z[n] - map.z[i]).abs() <= step {
                        seen[n] = true;
                        open.push(n);
                    }
                }
            }
        }
        if piece.len() < least {
            piece.iter().for_each(|i| goes[*i] = true);
        }
    }
    goes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Rigid;

    /// A slope that rises by 0.1 a cell, a block of 10 x 10 cells 5 mm above it, 3 glints, and a pair of cells off
    /// the surface.
    fn map() -> HeightMap {
        let mut map = HeightMap::empty(60, 40, 0.5, Rigid::identity());
        for i in 0..map.z.len() {
            let (x, y) = (i % 60, i / 60);
            let block = (20..30).contains(&x) && (10..20).contains(&y);
            map.z[i] = 0.1 * x as f32 + if block { 5.0 } else { 0.0 };
        }
        map.sigma.fill(0.01);
        map.intensity.fill(100.0);
        map.count.fill(3);
        for (x, y) in [(5, 5), (50, 30), (25, 15), (40, 5), (41, 6)] {
            map.z[y * 60 + x] += 20.0;
        }
        map.sigma[7] = 0.5;
        map
    }

    #[test]
    fn islands_take_glints_and_leave_corners_slopes_and_blocks() {
        let (before, mut after) = (map(), map());
        assert_eq!(Filter::Islands { least_cells: 5, step_mm: 0.3 }.apply(&mut after), 5);
        for i in 0..before.z.len() {
            let glint = [5 * 60 + 5, 30 * 60 + 50, 15 * 60 + 25, 5 * 60 + 40, 6 * 60 + 41].contains(&i);
            assert_eq!(after.z[i].is_nan(), glint, "cell {i}");
            assert!(glint || after.z[i] == before.z[i] && after.count[i] == 3);
        }
        let mut all = map();
        assert_eq!(
            Filter::Islands { least_cells: 200, step_mm: 0.3 }.apply(&mut all),
            5 + 99,
            "the block goes with its glint"
        );
    }

    #[test]
    fn each_filter_takes_what_it_says() {
        let mut m = map();
        assert_eq!(Filter::Sigma { most_mm: 0.1 }.apply(&mut m), 1);
        assert!(m.z[7].is_nan() && m.intensity[7].is_nan() && m.sigma[7].is_nan() && m.count[7] == 0);
        assert_eq!(Filter::Sigma { most_mm: 0.1 }.apply(&mut m), 0, "what is gone goes once");
        assert_eq!(Filter::Heights { low_mm: -1.0, high_mm: 15.0 }.apply(&mut m), 5);
        // Columns 4 to 7, rows 0 to 1; one cell was removed before.
        assert_eq!(Filter::Cut { corners: [4.0, 1.0, 2.0, 0.0] }.apply(&mut m), 7);
        let left = m.z.iter().filter(|z| z.is_finite()).count();
        assert_eq!(Filter::Keep { corners: [10.0, 5.0, 15.0, 10.0] }.apply(&mut m), left - 99);
    }

    #[test]
    fn words_and_numbers_that_mean_nothing_are_refused() {
        let read = |s: &str| s.parse::<Filter>();
        assert_eq!(read("heights:-1,4.5"), Ok(Filter::Heights { low_mm: -1.0, high_mm: 4.5 }));
        assert_eq!(read("islands:20,0.5"), Ok(Filter::Islands { least_cells: 20, step_mm: 0.5 }));
        for bad in [
            "",
            "sigma",
            "sigma:0",
            "sigma:nan",
            "heights:4,1",
            "cut:1,2,3",
            "cut:1,2,1,4",
            "islands:1,1",
            "islands:2.5,1",
            "blur:3",
        ] {
            assert!(read(bad).is_err(), "{bad}");
        }
    }
}
