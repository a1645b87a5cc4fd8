//! In: what a program chose of the remote device. Out: the parts of a buffer, where they lie, and their bytes.
//! Frame and unit: mm; pixels of the frame.

use crate::source::{Layout, Taken};
use crate::standard::{component, pixel};
use sheetlight::geometry::Vec3;
use std::collections::BTreeMap;

/// Values of Scan3dOutputMode, as SFNC numbers nothing itself.
pub mod output {
    pub const RECTIFIED_C: i64 = 1;
    pub const GRID: i64 = 2;
    pub const POINT_CLOUD: i64 = 3;
}

/// Values of AcquisitionMode.
pub mod mode {
    pub const SINGLE: i64 = 1;
    pub const MULTI: i64 = 2;
    pub const CONTINUOUS: i64 = 3;
}

/// Parts begin at multiples of this many bytes, so that floats can be read in place.
const ALIGNED: usize = 16;

#[derive(Clone, Debug)]
pub struct Settings {
    pub region: Region,
    pub output: i64,
    /// Enabled components with their pixel formats.
    pub components: BTreeMap<i64, Component>,
    pub half_sigma_mm: f64,
    pub acquisition: i64,
    pub frame_count: i64,
    pub rate_hz: f64,
    pub triggered: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    pub x: u32,
    pub y: u32,
    pub width: u32,
    pub height: u32,
}

#[derive(Clone, Copy, Debug)]
pub struct Component {
    pub enabled: bool,
    pub format: i64,
}

/// A part of a buffer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    pub component: i64,
    pub format: i64,
    pub offset: usize,
    pub bytes: usize,
}

impl Settings {
    pub fn new(layout: &Layout, external: bool) -> Settings {
        let component = |format, enabled| Component { format, enabled };
        Settings {
            region: Region { x: 0, y: 0, width: layout.width, height: layout.height },
            output: output::GRID,
            components: BTreeMap::from([
                (component::RANGE, component(pixel::COORD3D_ABC32F, true)),
                (component::INTENSITY, component(pixel::MONO16, true)),
                (component::CONFIDENCE, component(pixel::CONFIDENCE8, true)),
            ]),
            half_sigma_mm: 0.1,
            acquisition: mode::CONTINUOUS,
            frame_count: 1,
            rate_hz: 10.0,
            triggered: external,
        }
    }

    /// Columns and rows of the whole frame.
    pub fn most(&self, layout: &Layout) -> [u32; 2] {
        if self.output == output::POINT_CLOUD { [layout.points, 1] } else { [layout.width, layout.height] }
    }

    /// Changes the output; the range's format follows, and the region is the whole frame again.
    pub fn set_output(&mut self, mode: i64, layout: &Layout) {
        let same = self.most(layout);
        self.output = mode;
        let range = self.components.get_mut(&component::RANGE).expect("always there");
        let abc = range.format == pixel::COORD3D_ABC32F;
        match mode {
            output::RECTIFIED_C if abc => range.format = pixel::COORD3D_C16,
            output::RECTIFIED_C => {}
            _ => range.format = pixel::COORD3D_ABC32F,
        }
        let [width, height] = self.most(layout);
        if same != [width, height] {
            self.region = Region { x: 0, y: 0, width, height };
        }
    }

    /// The parts of a buffer, in the order of a 3-D frame: range, intensity, confidence.
    pub fn parts(&self) -> Vec<Part> {
        let pixels = self.region.width as usize * self.region.height as usize;
        let mut parts: Vec<Part> = Vec::new();
        for which in [component::RANGE, component::INTENSITY, component::CONFIDENCE] {
            let Component { enabled, format } = self.components[&which];
            if enabled {
                let offset = parts.last().map_or(0, |p: &Part| (p.offset + p.bytes).next_multiple_of(ALIGNED));
                parts.push(Part { component: which, format, offset, bytes: pixels * pixel::bytes(format) });
            }
        }
        parts
    }

    /// Bytes of a frame.
    pub fn payload(&self) -> usize {
        self.parts().last().map_or(0, |p| p.offset + p.bytes)
    }

    /// Writes a frame into `out`, which has room for it.
    pub fn fill(&self, taken: &Taken, layout: &Layout, out: &mut [u8]) {
        for part in self.parts() {
            let bytes = &mut out[part.offset..part.offset + part.bytes];
            let Region { x, y, width, height } = self.region;
            let pixels = bytes.chunks_exact_mut(pixel::bytes(part.format));
            let at = (y..y + height).flat_map(|row| (x..x + width).map(move |column| (column, row)));
            for (pixel, (column, row)) in pixels.zip(at) {
                self.pixel(&part, &Sample::at(self, taken, column, row), layout, pixel);
            }
        }
    }

    fn pixel(&self, part: &Part, sample: &Sample, layout: &Layout, out: &mut [u8]) {
        let level = |bits: u8, most: f32| {
            let scaled = sample.intensity / f32::from(1u16 << (bits - 8));
            // NaN becomes 0.
            scaled.round().clamp(0.0, most) as u16
        };
        match part.format {
            pixel::COORD3D_ABC32F => {
                for (axis, bytes) in sample.point.iter().zip(out.chunks_exact_mut(4)) {
                    bytes.copy_from_slice(&axis.to_le_bytes());
                }
            }
            pixel::COORD3D_C32F => out.copy_from_slice(&sample.height.to_le_bytes()),
            pixel::COORD3D_C16 => out.copy_from_slice(&layout.c16(sample.height).to_le_bytes()),
            pixel::MONO8 => out[0] = level(sample.bits, 255.0) as u8,
            pixel::MONO16 => out.copy_from_slice(&level(8, 65_535.0).to_le_bytes()),
            pixel::CONFIDENCE8 => out[0] = self.confidence(sample.sigma, 255.0) as u8,
            pixel::CONFIDENCE16 => out.copy_from_slice(&self.confidence(sample.sigma, 65_535.0).to_le_bytes()),
            other => unreachable!("{other:#x} is not offered"),
        }
    }

    /// `most` for an exact height, half of it where the standard deviation is `half_sigma_mm`; 0 where nothing was
    /// measured, and only there.
    fn confidence(&self, sigma: f32, most: f64) -> u16 {
        if !sigma.is_finite() {
            return 0;
        }
        (most / (1.0 + f64::from(sigma) / self.half_sigma_mm)).round().max(1.0) as u16
    }
}

/// What was measured at one place; NaN is missing.
struct Sample {
    /// In the cloud's frame.
    point: [f32; 3],
    /// Above the grid's plane.
    height: f32,
    intensity: f32,
    sigma: f32,
    bits: u8,
}

impl Sample {
    fn at(settings: &Settings, taken: &Taken, column: u32, row: u32) -> Sample {
        if settings.output == output::POINT_CLOUD {
            let p = &taken.points[column as usize];
            let point = p.position.to_array();
            return Sample { point, height: point[2], intensity: p.intensity, sigma: p.sigma_mm, bits: taken.bits };
        }
        let map = &taken.map;
        let i = row as usize * map.width as usize + column as usize;
        let centre = |n: u32| (f64::from(n) + 0.5) * map.cell;
        let height = map.z[i];
        let point = if height.is_finite() {
            let p = map.base_from_grid.point(&Vec3::new(centre(column), centre(row), f64::from(height)));
            [p.x as f32, p.y as f32, p.z as f32]
        } else {
            [f32::NAN; 3]
        };
        Sample { point, height, intensity: map.intensity[i], sigma: map.sigma[i], bits: taken.bits }
    }
}
