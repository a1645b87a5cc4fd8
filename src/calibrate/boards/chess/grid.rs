//! In: a picture. Out: labelled square lattices of chessboard corners, from several front ends that are tried in
//! turn. Labels start anywhere and run in any direction.
//! Frame and unit: pixels. Only this file uses the crates `chess-corners`, `calib-targets-chessboard` and
//! `calib-targets-core`.

use crate::calibrate::boards::refine::{Corner, Grey, Window, corner};
use crate::geometry::Vec2;
use calib_targets_chessboard::{ChessCorner, ChessboardDetector, ChessboardParams, GrayImageView};
use calib_targets_core::{DetectorConfig, default_chess_config};
use chess_corners::{ImageRefiner, UpscaleConfig};
use rayon::prelude::*;

/// A lattice: `at(i, j)` is the corner with label (i, j), if one was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    pub columns: usize,
    pub rows: usize,
    pub corners: Vec<Option<Vec2>>,
}

impl Grid {
    pub fn at(&self, i: isize, j: isize) -> Option<Vec2> {
        let inside = i >= 0 && j >= 0 && i < self.columns as isize && j < self.rows as isize;
        inside.then(|| self.corners[j as usize * self.columns + i as usize]).flatten()
    }
    pub fn count(&self) -> usize {
        self.corners.iter().flatten().count()
    }
    /// Steps to the next corners along i and j, by central differences if both neighbours are known.
    pub fn steps(&self, i: isize, j: isize) -> Option<(Vec2, Vec2)> {
        let along = |di: isize, dj: isize| {
            let (before, here, after) = (self.at(i - di, j - dj), self.at(i, j), self.at(i + di, j + dj));
            match (before, here, after) {
                (Some(b), _, Some(a)) => Some((a - b) / 2.0),
                (None, Some(h), Some(a)) => Some(a - h),
                (Some(b), Some(h), None) => Some(h - b),
                _ => None,
            }
        };
        Some((along(1, 0)?, along(0, 1)?))
    }
    /// Median length of a step, px.
    pub fn pitch(&self) -> f64 {
        let mut all: Vec<f64> =
            self.labels().filter_map(|(i, j)| self.steps(i, j)).map(|(u, v)| u.norm().min(v.norm())).collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied().unwrap_or(0.0)
    }
    pub fn labels(&self) -> impl Iterator<Item = (isize, isize)> + use<> {
        let (c, r) = (self.columns as isize, self.rows as isize);
        (0..r).flat_map(move |j| (0..c).map(move |i| (i, j)))
    }
    /// The lattice rotated by a quarter turn: new (i, j) = old (j, rows - 1 - i). The handedness does not change.
    pub fn quarter_turn(&self) -> Grid {
        let (columns, rows) = (self.rows, self.columns);
        let corners = (0..rows)
            .flat_map(|j| (0..columns).map(move |i| (i, j)))
            .map(|(i, j)| self.corners[(self.rows - 1 - i) * self.columns + j])
            .collect();
        Grid { columns, rows, corners }
    }
    /// The lattice with `margin` unknown rows and columns added on each side.
    pub fn padded(&self, margin: usize) -> Grid {
        let (columns, rows) = (self.columns + 2 * margin, self.rows + 2 * margin);
        let mut corners = vec![None; columns * rows];
        for (k, c) in self.corners.iter().enumerate() {
            corners[(k / self.columns + margin) * columns + k % self.columns + margin] = *c;
        }
        Grid { columns, rows, corners }
    }
    /// Ranges of columns and of rows of the lattice without outer lines that hold fewer than half of their corners.
    pub fn extent(&self) -> [std::ops::Range<usize>; 2] {
        let known = |i: usize, j: usize| usize::from(self.corners[j * self.columns + i].is_some());
        let span = |n: usize, any: &dyn Fn(usize) -> bool| {
            let first = (0..n).find(|k| any(*k)).unwrap_or(0);
            first..(first..n).rev().find(|k| any(*k)).map_or(first, |k| k + 1)
        };
        let mut across = span(self.columns, &|i| (0..self.rows).any(|j| known(i, j) > 0));
        let mut down = span(self.rows, &|j| (0..self.columns).any(|i| known(i, j) > 0));
        while !across.is_empty() && !down.is_empty() {
            let column = |i: usize| 2 * down.clone().map(|j| known(i, j)).sum::<usize>() < down.len();
            let row = |j: usize| 2 * across.clone().map(|i| known(i, j)).sum::<usize>() < across.len();
            let weak = [column(across.start), column(across.end - 1), row(down.start), row(down.end - 1)];
            match weak.iter().position(|w| *w) {
                Some(0) => across.start += 1,
                Some(1) => across.end -= 1,
                Some(2) => down.start += 1,
                Some(_) => down.end -= 1,
                None => break,
            }
        }
        [across, down]
    }
    /// Mirrored along i.
    pub fn mirrored(&self) -> Grid {
        let corners = (0..self.rows)
            .flat_map(|j| (0..self.columns).map(move |i| (i, j)))
            .map(|(i, j)| self.corners[j * self.columns + self.columns - 1 - i])
            .collect();
        Grid { corners, ..*self }
    }
    /// True if i, j have the handedness of x, y in the picture (seen from the front).
    pub fn right_handed(&self) -> bool {
        let sum: f64 =
            self.labels().filter_map(|(i, j)| self.steps(i, j)).map(|(u, v)| (u.x * v.y - u.y * v.x).signum()).sum();
        sum > 0.0
    }
    /// Predicts unknown corners from their neighbours. False if more than a share `most` of all is missing, or if one
    /// cannot be predicted.
    pub fn fill_gaps(&mut self, most: f64) -> bool {
        let missing = self.corners.len() - self.count();
        if missing as f64 > most * self.corners.len() as f64 {
            return false;
        }
        for _ in 0..missing {
            let predicted = self
                .labels()
                .filter(|&(i, j)| self.at(i, j).is_none())
                .find_map(|(i, j)| Some((i, j, self.predict(i, j)?)));
            let Some((i, j, p)) = predicted else { return false };
            self.corners[j as usize * self.columns + i as usize] = Some(p);
        }
        true
    }
    /// Position of corner (i, j) as its neighbours predict it, whether it is known or not.
    fn predict(&self, i: isize, j: isize) -> Option<Vec2> {
        let between = |di: isize, dj: isize| Some((self.at(i - di, j - dj)? + self.at(i + di, j + dj)?) / 2.0);
        let beyond = |di: isize, dj: isize| Some(self.at(i + di, j + dj)? * 2.0 - self.at(i + 2 * di, j + 2 * dj)?);
        let guesses = [between(1, 0), between(0, 1), beyond(1, 0), beyond(-1, 0), beyond(0, 1), beyond(0, -1)];
        guesses.into_iter().flatten().next()
    }
    /// Index and predicted position of every unknown corner with suitable neighbours.
    pub fn predicted(&self) -> Vec<(usize, Vec2)> {
        let unknown = self.labels().filter(|&(i, j)| self.at(i, j).is_none());
        unknown.filter_map(|(i, j)| Some((j as usize * self.columns + i as usize, self.predict(i, j)?))).collect()
    }
    /// Refines each known corner in the picture; those whose fit fails become `None`.
    pub fn refined(&self, grey: &Grey, window: &Window, band_px: f64) -> Vec<Option<Corner>> {
        let labels: Vec<(isize, isize)> = self.labels().collect();
        labels
            .par_iter()
            .map(|&(i, j)| {
                let start = self.at(i, j)?;
                let (u, v) = self.steps(i, j)?;
                let with = |start: &Vec2, band_px: f64, longest_px: f64| {
                    let margin = window.margin.min(band_px / u.norm().min(v.norm()));
                    corner(grey, start, &u, &v, &Window { margin, longest_px, ..*window })
                };
                let first = with(&start, band_px, window.longest_px)?;
                // A blurred edge is wider than the band, and its fit needs a longer part of the edge.
                let (band, longest) = (3.5 * first.blur_px, 8.0 * first.blur_px);
                if band <= band_px {
                    return Some(first);
                }
                with(&first.pixel, band, longest.max(window.longest_px)).or(Some(first))
            })
            .collect()
    }
}

/// A method to find corners, in the order of cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrontEnd {
    /// ChESS on the picture at its own size.
    Plain,
    /// ChESS on the picture enlarged twice, for squares below about 12 px.
    Enlarged,
    /// Duda and Frese's Radon response, for blur and low contrast.
    Radon,
}

impl FrontEnd {
    pub const ALL: [FrontEnd; 3] = [FrontEnd::Plain, FrontEnd::Enlarged, FrontEnd::Radon];

    /// Corner candidates in an 8-bit picture.
    pub fn candidates(self, view: &GrayImageView<'_>) -> Vec<ChessCorner> {
        let config = match self {
            FrontEnd::Plain => default_chess_config(),
            FrontEnd::Enlarged => default_chess_config().with_upscale(UpscaleConfig::Fixed(2)),
            FrontEnd::Radon => DetectorConfig::radon(),
        };
        calib_targets_chessboard::detect_corners(view, &config.with_refiner(ImageRefiner::saddle_point()))
    }
}

/// All lattices in a set of candidates, the largest first.
pub fn lattices(candidates: &[ChessCorner], weakest: Option<f32>) -> Vec<Grid> {
    let mut params = ChessboardParams::default();
    if let Some(weakest) = weakest {
        params.min_corner_strength = weakest;
    }
    let Ok(detector) = ChessboardDetector::new(params) else { return Vec::new() };
    let mut grids: Vec<Grid> = detector
        .detect_all(candidates)
        .iter()
        .filter_map(|found| {
            let labels = found.corners.iter().map(|c| (c.grid.u, c.grid.v));
            let (u0, v0) = (labels.clone().map(|l| l.0).min()?, labels.clone().map(|l| l.1).min()?);
            let (u1, v1) = (labels.clone().map(|l| l.0).max()?, labels.map(|l| l.1).max()?);
            let (columns, rows) = ((u1 - u0 + 1) as usize, (v1 - v0 + 1) as usize);
            let mut corners = vec![None; columns * rows];
            for c in &found.corners {
                let i = (c.grid.v - v0) as usize * columns + (c.grid.u - u0) as usize;
                corners[i] = Some(Vec2::new(f64::from(c.position.x), f64::from(c.position.y)));
            }
            let grid = Grid { columns, rows, corners };
            Some(if grid.right_handed() { grid } else { grid.mirrored() })
        })
        .collect();
    grids.sort_by_key(|g| std::cmp::Reverse(g.count()));
    grids
}

/// An 8-bit picture for the detectors, reduced in size and with its grey levels stretched to the full range.
/// `to_full` maps its points back to the full picture (pixel centres at integers in both).
pub struct Prepared {
    pub width: usize,
    pub height: usize,
    pub levels: Vec<u8>,
    pub shrink: usize,
    /// Range of grey levels between the 1st and 99th percentile as a share of full scale.
    pub span: f64,
}

impl Prepared {
    /// Averages `shrink` x `shrink` pixels, and stretches the contrast if it uses less than half of the range.
    pub fn new(image: &crate::raster::Image, grey: &Grey, shrink: usize) -> Prepared {
        let Grey { width, height, levels: small } = grey.shrunk(shrink);
        let full = f32::from(image.full_scale());
        let mut histogram = [0usize; 256];
        small.iter().for_each(|&v| histogram[(v / full * 255.0) as usize] += 1);
        let level = |share: f64| {
            let mut left = (share * small.len() as f64) as usize;
            histogram.iter().position(|&n| {
                let hit = n > left;
                left = left.saturating_sub(n);
                hit
            })
        };
        let (low, high) = (level(0.01).unwrap_or(0) as f32, level(0.99).unwrap_or(255) as f32);
        let (offset, gain) = if high - low < 128.0 { (low, 230.0 / (high - low).max(8.0)) } else { (0.0, 1.0) };
        let levels = small.iter().map(|v| ((v / full * 255.0 - offset) * gain).clamp(0.0, 255.0) as u8).collect();
        Prepared { width, height, levels, shrink, span: f64::from((high - low) / 255.0) }
    }
    pub fn view(&self) -> GrayImageView<'_> {
        GrayImageView { width: self.width, height: self.height, data: &self.levels }
    }
    /// Converts a point of the prepared picture to the full picture, px.
    pub fn to_full(&self, p: &Vec2) -> Vec2 {
        let s = self.shrink as f64;
        p.map(|c| (c + 0.5) * s - 0.5)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_with_few_corners_are_no_part_of_a_board() {
        let at = |k: i32| Some(Vec2::new(f64::from(k % 4) * 10.0, f64::from(k / 4) * 9.0));
        let grid = Grid { columns: 4, rows: 3, corners: (0..12).map(at).collect() };
        let mut padded = grid.padded(2);
        assert_eq!((padded.columns, padded.rows, padded.count()), (8, 7, 12));
        assert_eq!(padded.extent(), [2..6, 2..5]);
        // A speck of the background beside the board, and a corner hidden by glare.
        padded.corners[8 * 3 + 6] = Some(Vec2::new(40.0, 9.0));
        padded.corners[8 * 2 + 2] = None;
        assert_eq!(padded.extent(), [2..6, 2..5]);
        padded.corners.fill(None);
        assert!(padded.extent().iter().any(|r| r.is_empty()));
    }

    #[test]
    fn turns_keep_handedness_and_four_of_them_are_none() {
        let corners = (0..12).map(|k| Some(Vec2::new(f64::from(k % 4) * 10.0, f64::from(k / 4) * 9.0))).collect();
        let grid = Grid { columns: 4, rows: 3, corners };
        let turned = grid.quarter_turn();
        assert!(grid.right_handed() && turned.right_handed() && !grid.mirrored().right_handed());
        assert_eq!((turned.columns, turned.rows), (3, 4));
        assert_eq!(turned.quarter_turn().quarter_turn().quarter_turn(), grid);
    }
}
