//! In: pictures and height maps. Out: layers of numbers with missing cells, and their pyramids.
//! Frame and unit: pixels, x right (along columns), y down (along rows), an integer is a cell's centre;
//! values in grey levels (intensity) or mm (height).

use super::mend::mended;
use crate::fault::{Fault, Result};
use crate::raster::{Image, Mask};
use crate::scan::HeightMap;

/// What a layer's numbers are; a model edge is searched only in layers of its own kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Grey levels.
    Intensity,
    /// mm.
    Height,
}

/// One map of numbers, row-major; NaN marks a missing cell, which never makes an edge.
#[derive(Clone, Debug)]
pub struct Layer {
    /// What the values are.
    pub kind: Kind,
    /// Columns, px.
    pub width: usize,
    /// Rows, px.
    pub height: usize,
    /// Row-major, `width` x `height`; NaN is missing.
    pub values: Vec<f32>,
}

/// What is searched: one or more layers of the same size.
#[derive(Clone, Debug)]
pub struct Scene {
    /// At least one, all of the same size.
    pub layers: Vec<Layer>,
    /// Edge length of a cell in mm; `None` for a picture without scale.
    pub mm_per_px: Option<f64>,
}

impl Layer {
    /// Refuses a size that does not match the number of values, and infinite values.
    pub fn new(kind: Kind, width: usize, height: usize, values: Vec<f32>) -> Result<Layer> {
        if values.len() != width * height || width == 0 || height == 0 {
            return Err(Fault::input(format!("a map of {width}x{height} cells holds {} values", values.len()))
                .cause("a truncated file")
                .next("export the map again"));
        }
        if values.iter().any(|v| v.is_infinite()) {
            return Err(Fault::input("a map holds an infinite value")
                .cause("a failed division in the program that wrote it")
                .next("write missing cells as NaN"));
        }
        Ok(Layer { kind, width, height, values })
    }

    /// A picture's grey levels; no cell is missing.
    pub fn from_image(image: &Image) -> Layer {
        Layer {
            kind: Kind::Intensity,
            width: image.width as usize,
            height: image.height as usize,
            values: image.to_f32(),
        }
    }

    /// Fills missing cells with the values of their neighbours, ring by ring; a layer without any value stays
    /// unchanged.
    fn carry_on(&mut self) {
        let (w, h) = (self.width, self.height);
        let mut ring: Vec<usize> = (0..w * h).filter(|i| !self.values[*i].is_nan()).collect();
        while !ring.is_empty() {
            let mut next = vec![];
            for i in ring {
                let (x, y) = (i % w, i / w);
                let beside =
                    [(x > 0, i.wrapping_sub(1)), (x + 1 < w, i + 1), (y > 0, i.wrapping_sub(w)), (y + 1 < h, i + w)];
                for (_, k) in beside.into_iter().filter(|b| b.0) {
                    if self.values[k].is_nan() {
                        self.values[k] = self.values[i];
                        next.push(k);
                    }
                }
            }
            ring = next;
        }
    }

    /// Share of cells that hold a value.
    pub fn coverage(&self) -> f64 {
        self.values.iter().filter(|v| !v.is_nan()).count() as f64 / self.values.len() as f64
    }

    /// True where no cell is missing.
    pub fn complete(&self) -> bool {
        !self.values.iter().any(|v| v.is_nan())
    }

    /// Half the size: the mean of the valid cells of each 2x2 block, missing where fewer than two are
    /// valid. Cell (x, y) has its centre at (2x + 0.5, 2y + 0.5) of the finer map.
    pub fn halved(&self) -> Layer {
        let (w, h) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let mut values = vec![f32::NAN; w * h];
        for y in 0..h {
            for x in 0..w {
                let (mut sum, mut n) = (0.0, 0);
                for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let (xx, yy) = ((2 * x + dx).min(self.width - 1), (2 * y + dy).min(self.height - 1));
                    let v = self.values[yy * self.width + xx];
                    if !v.is_nan() {
                        sum += v;
                        n += 1;
                    }
                }
                if n >= 2 {
                    values[y * w + x] = sum / n as f32;
                }
            }
        }
        Layer { kind: self.kind, width: w, height: h, values }
    }

    /// Cuts out `[x0, x1) x [y0, y1)`.
    pub fn crop(&self, region: Region) -> Layer {
        let (w, h) = (region.x1 - region.x0, region.y1 - region.y0);
        let mut values = Vec::with_capacity(w * h);
        for y in region.y0..region.y1 {
            values.extend_from_slice(&self.values[y * self.width + region.x0..y * self.width + region.x1]);
        }
        Layer { kind: self.kind, width: w, height: h, values }
    }
}

/// A rectangle of cells, `x1` and `y1` excluded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// First column.
    pub x0: usize,
    /// First row.
    pub y0: usize,
    /// Column after the last one.
    pub x1: usize,
    /// Row after the last one.
    pub y1: usize,
}

impl Region {
    /// Refuses regions that are empty or reach beyond a map of `width` x `height`.
    pub fn check(&self, width: usize, height: usize) -> Result<()> {
        if self.x0 >= self.x1 || self.y0 >= self.y1 || self.x1 > width || self.y1 > height {
            return Err(Fault::usage(format!(
                "the region {} {} {} {} does not lie in the map of {width}x{height} cells",
                self.x0, self.y0, self.x1, self.y1
            ))
            .cause("corners swapped, or numbers of another map")
            .next("give x0 y0 x1 y1 in cells, x1 and y1 excluded"));
        }
        Ok(())
    }
}

impl Scene {
    /// `mm_per_px` is the edge of a cell, mm. Refuses an empty list, and layers that differ in size.
    pub fn new(layers: Vec<Layer>, mm_per_px: Option<f64>) -> Result<Scene> {
        let Some(first) = layers.first() else {
            return Err(Fault::input("a scene without layers")
                .cause("neither height nor intensity was chosen")
                .next("name height, intensity or both"));
        };
        if layers.iter().any(|l| (l.width, l.height) != (first.width, first.height)) {
            return Err(Fault::input("the layers of a scene differ in size")
                .cause("height and intensity of two different scans")
                .next("give maps of the same scan"));
        }
        Ok(Scene { layers, mm_per_px })
    }
    /// A picture's grey levels as the only layer, without scale.
    pub fn from_image(image: &Image) -> Scene {
        Scene { layers: vec![Layer::from_image(image)], mm_per_px: None }
    }
    /// A height map's heights as the only layer, with its scale. Spikes of single cells are removed and small gaps
    /// filled, so that neither hides an edge. Refuses infinite heights.
    pub fn from_heights(map: &HeightMap) -> Result<Scene> {
        let layer =
            Layer::new(Kind::Height, map.width as usize, map.height as usize, mended(&map.z, map.width as usize))?;
        Scene::new(vec![layer], Some(map.cell))
    }
    /// Like `from_image`, but the cells where `hidden` is set are missing.
    pub fn from_image_in_part(image: &Image, hidden: Option<&Mask>) -> Scene {
        let mut scene = Scene::from_image(image);
        if let Some(hidden) = hidden {
            let columns = image.width as usize;
            for (i, v) in scene.layers[0].values.iter_mut().enumerate() {
                if hidden.get((i % columns) as u32, (i / columns) as u32) {
                    *v = f32::NAN;
                }
            }
        }
        scene
    }
    /// Fills each missing cell with the value of a nearest valid cell, counted in steps along columns and rows.
    pub fn carried_on(mut self) -> Scene {
        self.layers.iter_mut().for_each(Layer::carry_on);
        self
    }
    /// Columns, px.
    pub fn width(&self) -> usize {
        self.layers[0].width
    }
    /// Rows, px.
    pub fn height(&self) -> usize {
        self.layers[0].height
    }
    /// Level 0 is the scene itself; each further level has half the size.
    pub fn pyramid(&self, levels: usize) -> Vec<Vec<Layer>> {
        let mut out = vec![self.layers.clone()];
        for _ in 1..levels {
            let coarser = out.last().expect("never empty").iter().map(Layer::halved).collect();
            out.push(coarser);
        }
        out
    }
    /// Cuts the same cells out of every layer; the region must lie within the scene.
    pub fn crop(&self, region: Region) -> Scene {
        Scene { layers: self.layers.iter().map(|l| l.crop(region)).collect(), mm_per_px: self.mm_per_px }
    }
}

/// A coordinate of level 0 expressed on level `level`: (x + 1/2) / 2^level - 1/2.
pub fn to_level(x: f64, level: usize) -> f64 {
    (x + 0.5) / (1u64 << level) as f64 - 0.5
}

/// The inverse of [`to_level`].
pub fn from_level(x: f64, level: usize) -> f64 {
    (x + 0.5) * (1u64 << level) as f64 - 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halving_keeps_places_and_forgets_missing_cells() {
        // A ramp: value = x; the halved map must hold x at its own cell centres.
        let ramp: Vec<f32> = (0..64).map(|i| (i % 8) as f32).collect();
        let fine = Layer::new(Kind::Height, 8, 8, ramp.clone()).unwrap();
        let coarse = fine.halved();
        for x in 0..4 {
            assert_eq!(f64::from(coarse.values[x]), from_level(x as f64, 1));
        }
        let mut holes = ramp;
        holes[0] = f32::NAN;
        holes[1] = f32::NAN;
        holes[8] = f32::NAN;
        let coarse = Layer::new(Kind::Height, 8, 8, holes).unwrap().halved();
        assert!(coarse.values[0].is_nan() && coarse.values[1] == 2.5);
        assert!((to_level(from_level(3.25, 3), 3) - 3.25).abs() < 1e-12);
    }

    #[test]
    fn regions_outside_the_map_are_refused() {
        assert!(Region { x0: 2, y0: 0, x1: 9, y1: 4 }.check(8, 8).is_err());
        assert!(Region { x0: 2, y0: 0, x1: 2, y1: 4 }.check(8, 8).is_err());
        assert!(Region { x0: 2, y0: 0, x1: 8, y1: 4 }.check(8, 8).is_ok());
    }
}
