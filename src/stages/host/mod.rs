//! In: pictures, one at a time. Out: their skeleton pixels, peaks and points, computed on the processor of this
//! machine. The order and the proofs are those of the GPU's chain: statistics of every pixel, then only the tiles that
//! may contain a lit pixel. Frame and unit: pixels; points in the poses' frame, mm.

use super::chain::config::ChainConfig;
use super::chain::measure::Measure;
use super::frame::{ALL_TILES, Frame, HAS_ROI};
use super::host::share::rows_of_band;
use super::peak::found::Peak;
use super::peak::{self, PeakFrame};
use super::stripe::choose::Lines;
use super::stripe::point::Point;
use super::stripe::spacing::COMPANY;
use super::stripe::{ambient, choose, lengthen, point, skeleton, spacing, threshold};
use super::{Thinning, ThresholdParams};
use crate::fault::Result;
use crate::raster::{Image, Mask, Pixels};
mod blocks;
mod light;
mod sample;
mod share;
mod thinning;

use blocks::{Blocks, Proof};
use light::{Sums, Tile, View};
use rayon::prelude::*;
use sample::Sample;
use std::sync::Mutex;
use thinning::{Tiles, Worn};

/// The chain for one size and depth of pictures. Threads share it, and each works on a different picture. A large
/// picture is divided among the threads that are free.
pub struct Host {
    frame: Frame,
    threshold: ThresholdParams,
    thinning: Thinning,
    weights: Vec<f32>,
    /// Tiles of the region of interest, row by row.
    region: Option<Vec<Tile>>,
    ambient: Option<Image>,
    measure: Option<(PeakFrame, Lines, Measure)>,
    /// Reused memory.
    spare: Mutex<Vec<Work>>,
}

/// The result of one shot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Found {
    /// Skeleton pixels x | y << 16, in the order of the GPU's list.
    pub pixels: Vec<u32>,
    /// One peak for each skeleton pixel, if peaks are measured.
    pub peaks: Vec<Peak>,
    /// One point for each peak, mm in the poses' frame; NaN if the peak was rejected.
    pub points: Vec<Point>,
}

/// Memory that is reused from picture to picture.
#[derive(Default)]
struct Work {
    bands: Vec<Band>,
    lit: Tiles,
    thin: Tiles,
    /// Indices of the tiles with a lit pixel, in the order of the skeleton's list.
    list: Vec<u32>,
    worn: Worn,
    added: Vec<(i32, i32)>,
    /// The skeleton tiles after `space`, in the order of the list.
    kept: Vec<Tile>,
}

/// Rows of tiles that one thread processes from top to bottom.
struct Band {
    blocks: Blocks,
    proof: Proof,
    /// Indices of its tiles with a lit pixel.
    list: Vec<u32>,
}

impl Host {
    /// Computes everything that all pictures share. `Err` if settings are out of range or the ambient picture does not
    /// fit.
    pub fn new(config: &ChainConfig) -> Result<Host> {
        let mut frame = Frame::new(config.width, config.height, config.bits, 1, &config.threshold)?;
        frame.flags |= if config.prune { 0 } else { ALL_TILES };
        frame.flags |= if config.region.is_some() { HAS_ROI } else { 0 };
        frame.lengthen = config.lengthen;
        frame.spacing = config.spacing;
        let tiles = |region: &Mask| {
            let words = frame.pack_mask(region);
            words.chunks_exact(8).map(|t| t.try_into().expect("eight words")).collect()
        };
        let measure = config.measure.as_ref().map(|m| {
            let size = (config.width, config.height, config.bits);
            let peaks = PeakFrame::new(size, 1, &m.peak, &m.choose, m.optics.across());
            let lines = Lines::new(&peaks, &m.choose);
            (peaks, lines, m.clone())
        });
        if let Some(image) = &config.ambient {
            frame.accept(image).map_err(|e| e.at("ambient picture"))?;
        }
        Ok(Host {
            threshold: config.threshold,
            thinning: config.thinning,
            weights: threshold::gaussian_weights(frame.size),
            region: config.region.as_ref().map(tiles),
            ambient: config.ambient.clone(),
            measure,
            spare: Mutex::default(),
            frame,
        })
    }

    /// Skeleton pixels of a picture and, if they are measured, peaks and points; `pose` as from [`point::pose_words`].
    pub fn run(&self, shot: u32, image: &Image, pose: &[f32; 12]) -> Result<Found> {
        self.work(image, true, |work, image| {
            let pixels = work.pixels();
            let Some((frame, lines, m)) = &self.measure else { return Found { pixels, ..Found::default() } };
            let mut peaks = peak::fitted(image, &pixels, shot, frame, m.peak.method);
            let mut strongest = vec![0u32; frame.lines as usize];
            peaks.iter_mut().for_each(|k| choose::alone(k, frame, &mut strongest));
            let mut points = vec![Point::NONE; peaks.len()];
            let some = |(peaks, points): (&mut [Peak], &mut [Point])| {
                peaks.iter_mut().for_each(|k| choose::beside(k, &strongest, lines));
                point::put(peaks, &m.optics, pose, points);
            };
            peaks.par_chunks_mut(peak::TOGETHER).zip(points.par_chunks_mut(peak::TOGETHER)).for_each(some);
            Found { pixels, peaks, points }
        })
    }

    /// The lit pixels of a picture, and their skeleton before its ends are lengthened; for tests and pictures.
    pub fn masks(&self, image: &Image) -> Result<[Mask; 2]> {
        self.work(image, false, |work, _| [&work.lit, &work.thin].map(|m| mask(m, &self.frame)))
    }

    /// Subtracts the ambient light and finds the skeleton; `ends` says whether its ends are lengthened and its pixels
    /// spaced. Passes the work and the picture to `then`.
    fn work<R>(&self, image: &Image, ends: bool, then: impl FnOnce(&Work, &Image) -> R) -> Result<R> {
        self.frame.accept(image)?;
        let spare = self.spare.lock().unwrap_or_else(|e| e.into_inner()).pop();
        let mut work = spare.unwrap_or_else(|| Work::new(&self.frame));
        let without = self.ambient.as_ref().map(|a| ambient::without(image, a));
        let image = without.as_ref().unwrap_or(image);
        match &image.pixels {
            Pixels::U8(px) => self.find(px, ends, &mut work),
            Pixels::U16(px) => self.find(px, ends, &mut work),
        }
        let found = then(&work, image);
        work.clear();
        self.spare.lock().unwrap_or_else(|e| e.into_inner()).push(work);
        Ok(found)
    }

    fn find<T: Sample>(&self, px: &[T], ends: bool, work: &mut Work) {
        let f = &self.frame;
        let (stride, tiles, tall) = (work.lit.stride, f.tiles_x as usize, rows_of_band(f.width));
        let view = View { px, f, p: self.threshold, weights: &self.weights };
        let band = |sums: &mut Sums<T::Wide>, (b, (out, band)): (usize, (&mut [Tile], &mut Band))| {
            band.list.clear();
            band.blocks.begin(b * tall);
            for (ty, out) in (b * tall..).zip(out.chunks_exact_mut(stride)) {
                band.blocks.prove(px, f, ty, &mut band.proof);
                let region = self.region.as_ref().map(|r| &r[ty * tiles..(ty + 1) * tiles]);
                let out = &mut out[1..=tiles];
                light::row(view, ty, &band.proof, region, sums, out);
                let first = ((ty + 1) * stride + 1) as u32;
                band.list.extend((first..).zip(&*out).filter(|(_, t)| **t != [0; 8]).map(|(at, _)| at));
            }
        };
        let inside = stride..stride * (f.tiles_y as usize + 1);
        let rows = work.lit.words[inside].par_chunks_mut(stride * tall).zip(&mut work.bands);
        rows.enumerate().for_each_init(Sums::default, band);
        work.list.clear();
        work.bands.iter().for_each(|b| work.list.extend_from_slice(&b.list));
        for &at in &work.list {
            work.thin.words[at as usize] = work.lit.words[at as usize];
        }
        thinning::thin(&mut work.thin, &work.list, (f.width, f.height), self.thinning, &mut work.worn);
        if !ends {
            return;
        }
        if f.lengthen != 0 {
            self.lengthen(px, work);
        }
        if f.spacing != 0 {
            self.space(work);
        }
    }

    /// Keeps one pixel in each column of a wide stripe, and no isolated lit pixels.
    fn space(&self, work: &mut Work) {
        let (w, h) = (self.frame.width as i32, self.frame.height as i32);
        let (lit, thin, kept) = (&work.lit, &work.thin, &mut work.kept);
        let (setting, near) = (self.frame.spacing, spacing::NEAR as usize);
        let get = |x: i32, y: i32| (0..w).contains(&x) && (0..h).contains(&y) && thin.get(x, y);
        kept.clear();
        kept.extend(work.list.iter().map(|&at| -> Tile {
            let (tx, ty) = thin.tile(at);
            let company = if setting & COMPANY == 0 { [u32::MAX; 8] } else { lit.in_company(at as usize, near) };
            if setting & !COMPANY == 0 {
                return std::array::from_fn(|r| thin.words[at as usize][r] & company[r]);
            }
            let alone = thin.alone(at as usize, setting & !COMPANY);
            std::array::from_fn(|r| {
                // A pixel without any other near it is a run of one.
                let mut some = alone[r];
                let mut left = thin.words[at as usize][r] & !some;
                while left != 0 {
                    let bit = left.trailing_zeros();
                    left &= left - 1;
                    if spacing::kept((32 * tx + bit) as i32, 8 * ty as i32 + r as i32, setting, get) {
                        some |= 1 << bit;
                    }
                }
                some & company[r]
            })
        }));
        for (&at, tile) in work.list.iter().zip(&work.kept) {
            work.thin.words[at as usize] = *tile;
        }
    }

    /// Lengthens the skeleton's ends. Only lit pixels are added, so they lie in listed tiles.
    fn lengthen<T: Sample>(&self, px: &[T], work: &mut Work) {
        let (w, h) = (self.frame.width as i32, self.frame.height as i32);
        work.added.clear();
        let (lit, thin, added) = (&work.lit, &work.thin, &mut work.added);
        for &at in &work.list {
            let (tx, ty) = thin.tile(at);
            for (r, mut left) in thin.ends(at as usize).into_iter().enumerate() {
                while left != 0 {
                    let (x, y) = (32 * tx as i32 + left.trailing_zeros() as i32, 8 * ty as i32 + r as i32);
                    left &= left - 1;
                    if x < 3 || y < 3 || x >= w - 3 || y >= h - 3 {
                        continue;
                    }
                    let level = |x: i32, y: i32| T::number(px[(y * w + x) as usize].wide());
                    let lit = |x: i32, y: i32| lit.get(x, y);
                    let skeleton = |x: i32, y: i32| thin.get(x, y);
                    lengthen::carry(x, y, (w, h), self.frame.lengthen, skeleton, lit, level, |a, b| added.push((a, b)));
                }
            }
        }
        for &(x, y) in &work.added {
            work.thin.set(x, y);
        }
    }
}

impl Work {
    fn new(f: &Frame) -> Work {
        let (tiles, tall) = (Tiles::new(f.tiles_x, f.tiles_y), rows_of_band(f.width));
        let band = || Band { blocks: Blocks::new(f, tall), proof: Proof::default(), list: Vec::new() };
        let bands = (0..f.tiles_y.div_ceil(tall as u32)).map(|_| band()).collect();
        Work { bands, lit: tiles.clone(), thin: tiles, ..Work::default() }
    }

    fn pixels(&self) -> Vec<u32> {
        let mut pixels = Vec::new();
        for &at in &self.list {
            let (tx, ty) = self.thin.tile(at);
            for (r, &word) in (0..).zip(&self.thin.words[at as usize]) {
                let mut left = word;
                while left != 0 {
                    pixels.push(skeleton::pack(32 * tx + left.trailing_zeros(), 8 * ty + r));
                    left &= left - 1;
                }
            }
        }
        pixels
    }

    /// Clears the listed tiles; all others are empty.
    fn clear(&mut self) {
        for &at in &self.list {
            self.lit.words[at as usize] = [0; 8];
            self.thin.words[at as usize] = [0; 8];
        }
    }
}

fn mask(tiles: &Tiles, f: &Frame) -> Mask {
    Mask::from_fn(f.width, f.height, |x, y| tiles.get(x as i32, y as i32))
}

#[cfg(test)]
mod tests;
