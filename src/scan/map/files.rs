//! In: a height map. Out: float TIFFs, a 16-bit PNG with its scale beside it, pictures for viewing; and the height
//! map read back from them.
//! Frame and unit: heights in mm above the grid's plane; file row 0 is the smallest y (docs/file-formats.md).

use super::picture::Shown;
use crate::fault::{Fault, Result};
use crate::files::write_aside;
use crate::geometry::{Base, Grid, Rigid};
use crate::raster::{Image, float_tiff, png, read_float_tiff};
use crate::scan::HeightMap;
use rayon::prelude::*;
use std::path::Path;

/// `height.json`: what the pixels of `height.tif` and `height.png` mean.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MapScale {
    /// Version of this file: 1.
    pub format: u32,
    /// Unit of all lengths here: "mm".
    pub units: String,
    /// Columns of the map: cells along the grid's x.
    pub width: u32,
    /// Rows of the map: cells along the grid's y.
    pub height: u32,
    /// Edge of a cell, mm.
    pub cell_mm: f64,
    /// Pose of the grid in the cloud's frame, mm; its origin is the outer corner of cell (0, 0).
    #[serde(rename = "base_T_grid")]
    pub base_from_grid: Rigid<Base, Grid>,
    /// height.png: z = offset_mm + step_mm · (value - 1); value 0 is missing.
    pub png_offset_mm: f64,
    /// Height between two neighbouring values of height.png, mm, at least 0.0001.
    pub png_step_mm: f64,
    /// Value of height.png where nothing was measured: 0.
    pub png_missing: u16,
    /// States where the centre of the pixel in column i and row j lies in the grid frame.
    pub pixel_centre: String,
}

/// Most bytes of one of a map's files: 64 million cells of 4 bytes, and the file's header.
const MOST_BYTES: u64 = (4 << 26) + (1 << 20);
/// The files that [`HeightMap::save`] writes.
pub const MAP_FILES: [&str; 10] = [
    "height_picture.png",
    "intensity_picture.png",
    "sigma_picture.png",
    "coverage_picture.png",
    "height.png",
    "count.png",
    "height.tif",
    "intensity.tif",
    "sigma.tif",
    "height.json",
];
const CENTRE: &str = "((i + 0.5) cell_mm, (j + 0.5) cell_mm), row 0 first";

impl HeightMap {
    /// Writes height.tif, height.png, height.json, intensity.tif, sigma.tif, count.png and the pictures
    /// *_picture.png into `folder`.
    pub fn save(&self, folder: &Path) -> Result<()> {
        crate::files::make_folder(folder)?;
        let (w, h) = (self.width, self.height);
        let (scale, pixels) = self.to_u16();
        let map = |values: &[f32], what: &str| float_tiff(w, h, values, &format!("{what}; NaN is missing"));
        let deep = |levels: Vec<u16>| png(&Image::from_u16(w, h, 16, levels));
        let picture = |what: Shown| self.picture(what).0.to_png();
        let files: [&(dyn Fn() -> Vec<u8> + Sync); 10] = [
            &|| picture(Shown::Height),
            &|| picture(Shown::Intensity),
            &|| picture(Shown::Sigma),
            &|| picture(Shown::Coverage),
            &|| deep(pixels.clone()),
            &|| deep(self.count.iter().map(|&n| n.min(65_535) as u16).collect()),
            &|| map(&self.z, "height above the grid plane, mm"),
            &|| map(&self.intensity, "stripe amplitude, grey levels"),
            &|| map(&self.sigma, "standard deviation of the height, mm"),
            &|| serde_json::to_string_pretty(&scale).expect("plain numbers").into_bytes(),
        ];
        let write = |(name, bytes): (&&str, &&(dyn Fn() -> Vec<u8> + Sync))| write_aside(&folder.join(name), &bytes());
        let written = MAP_FILES.par_iter().zip(&files).map(write).collect::<Result<Vec<_>>>()?;
        crate::files::keep_all(written)
    }

    /// 16-bit heights with their scale: 1..=65535 spans the map, 0 is missing.
    pub fn to_u16(&self) -> (MapScale, Vec<u16>) {
        let (low, high) = self.quantiles(0.0, 1.0).unwrap_or((0.0, 0.0));
        // At least 0.1 µm, so that a flat map does not magnify its noise.
        let step = (f64::from(high - low) / 65_534.0).max(1e-4);
        let value = |z: &f32| {
            if z.is_finite() { ((f64::from(*z) - f64::from(low)) / step).round() as u16 + 1 } else { 0 }
        };
        let scale = MapScale {
            format: 1,
            units: "mm".into(),
            width: self.width,
            height: self.height,
            cell_mm: self.cell,
            base_from_grid: self.base_from_grid,
            png_offset_mm: f64::from(low),
            png_step_mm: step,
            png_missing: 0,
            pixel_centre: CENTRE.into(),
        };
        (scale, self.z.iter().map(value).collect())
    }

    /// Reads what [`HeightMap::save`] wrote.
    pub fn load(folder: &Path) -> Result<HeightMap> {
        let read = |name: &str| {
            let path = folder.join(name);
            crate::files::read(&path, MOST_BYTES)
        };
        let other = |what: String| {
            Fault::input(format!("{}: {what}", folder.display()))
                .cause("files of two scans in one folder, or edited by hand")
                .next("scan again")
        };
        let scale: MapScale =
            serde_json::from_slice(&read("height.json")?).map_err(|e| other(format!("height.json: {e}")))?;
        if scale.format != 1 || scale.units != "mm" || scale.pixel_centre != CENTRE {
            return Err(other("height.json is of another format than 1, or not in mm".into()));
        }
        let plane = |name: &str| -> Result<Vec<f32>> {
            let (w, h, values) = read_float_tiff(&read(name)?).map_err(|e| e.at(folder.join(name).display()))?;
            if (w, h) != (scale.width, scale.height) {
                return Err(other(format!("{name} is {w}x{h}, height.json says {}x{}", scale.width, scale.height)));
            }
            Ok(values)
        };
        // Read before the map's memory is allocated: the planes are only as large as the files that hold them.
        let (z, intensity, sigma) = (plane("height.tif")?, plane("intensity.tif")?, plane("sigma.tif")?);
        let size = [scale.width, scale.height];
        let counts = crate::raster::load_sized(&folder.join("count.png"), Default::default(), 16, size)?;
        let mut map = HeightMap::empty(scale.width, scale.height, scale.cell_mm, scale.base_from_grid);
        (map.z, map.intensity, map.sigma) = (z, intensity, sigma);
        map.count = counts.to_f32().into_iter().map(|n| n as u32).collect();
        Ok(map)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;

    fn map() -> HeightMap {
        let pose = Rigid::from_vectors(&Vec3::new(0.1, 0.2, 0.3), Vec3::new(400.0, -90.0, 60.0));
        let mut map = HeightMap::empty(17, 9, 0.35, pose);
        for i in 0..17 * 9 {
            if i % 5 != 0 {
                map.z[i] = -3.0 + 0.07 * i as f32;
                map.count[i] = i as u32;
                map.intensity[i] = i as f32;
                map.sigma[i] = 1e-3 * i as f32;
            }
        }
        map
    }

    #[test]
    fn a_saved_map_comes_back_bit_for_bit() {
        let dir = tempfile::tempdir().unwrap();
        let map = map();
        map.save(dir.path()).unwrap();
        let back = HeightMap::load(dir.path()).unwrap();
        let bits = |v: &[f32]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&map.z), bits(&back.z));
        assert_eq!(bits(&map.sigma), bits(&back.sigma));
        assert_eq!((map.count, map.cell), (back.count, back.cell));
        assert!(map.base_from_grid.difference(&back.base_from_grid).1 < 1e-12);
        std::fs::remove_file(dir.path().join("sigma.tif")).unwrap();
        assert!(HeightMap::load(dir.path()).is_err());
    }

    #[test]
    fn sixteen_bit_heights_are_right_to_half_a_step_and_zero_is_missing() {
        let map = map();
        let (scale, pixels) = map.to_u16();
        for (z, &p) in map.z.iter().zip(&pixels) {
            if z.is_finite() {
                let back = scale.png_offset_mm + scale.png_step_mm * (f64::from(p) - 1.0);
                assert!((back - f64::from(*z)).abs() <= 0.5001 * scale.png_step_mm);
            } else {
                assert_eq!(p, 0);
            }
        }
    }
}
