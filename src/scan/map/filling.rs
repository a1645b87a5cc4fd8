//! In: points, twice in any order. Out: the cells of a height map, filled by the grid stages on a GPU or by their
//! CPU twins.
//! Frame and unit: grid frame; whole steps until the means are taken, then mm and grey levels.

use crate::fault::{Fault, Result};
use crate::gpu::{Buffer, Device, Recording, Replay};
use crate::scan::{CloudPoint, GridSpec, HeightMap};
use crate::stages::grid;
use crate::stages::grid::{COUNT_MOST, GridFrame, Layer, SIGMA_STEP};

/// The two passes over the same points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pass {
    /// Lowest and highest point of each cell.
    Span,
    /// Sums below and above the middle between them.
    Sum,
}

/// Points handed to the GPU at a time: 2.4 MB.
const CHUNK: usize = 1 << 16;

/// A grid being filled.
pub struct Filling {
    frame: GridFrame,
    place: Place,
}

enum Place {
    Twin { span: Vec<[u32; 2]>, layers: Vec<[Layer; 2]> },
    Gpu(Box<Gpu>),
}

struct Gpu {
    device: Device,
    replay: Replay,
    uniform: Buffer,
    records: Buffer,
    cells: Buffer,
    span: Recording,
    sum: Recording,
    pick: Recording,
}

impl Filling {
    /// Runs on `device` if its buffers can hold the grid.
    pub fn new(spec: &GridSpec, min_quality: f32, device: Option<&Device>) -> Result<Filling> {
        let size = [spec.width, spec.height];
        let steps = (spec.cell, f64::from(spec.z_step));
        let frame =
            GridFrame::new(&spec.base_from_grid, size, steps, spec.layer_steps, min_quality, spec.most_intensity);
        let n = frame.cells();
        let fits = |d: &&Device| n as u64 * size_of::<[Layer; 2]>() as u64 <= d.info.max_binding_bytes;
        let place = match device.filter(fits) {
            Some(device) => Place::Gpu(Box::new(Gpu::new(device, &frame)?)),
            None => Place::Twin { span: vec![[0; 2]; n], layers: vec![[Layer::default(); 2]; n] },
        };
        Ok(Filling { frame, place })
    }

    pub fn take(&mut self, pass: Pass, points: &[CloudPoint]) -> Result<()> {
        for part in points.chunks(CHUNK) {
            self.frame.points = part.len() as u32;
            let records: &[u32] = bytemuck::cast_slice(part);
            match (&mut self.place, pass) {
                (Place::Twin { span, .. }, Pass::Span) => self.frame.span(records, span),
                (Place::Twin { span, layers }, Pass::Sum) => self.frame.sum(records, span, layers),
                (Place::Gpu(gpu), _) => gpu.take(&self.frame, pass, part)?,
            }
        }
        Ok(())
    }

    /// Computes the means of the sums. Refuses cells with more points than the integer sums can hold.
    pub fn resolve(self, spec: &GridSpec) -> Result<HeightMap> {
        let frame = self.frame;
        let cells: Vec<Layer> = match self.place {
            Place::Twin { span, layers } => {
                span.iter().zip(layers).map(|(&span, layers)| frame.pick(span, layers)).collect()
            }
            Place::Gpu(mut gpu) => {
                gpu.replay.run(&[&gpu.pick])?;
                bytemuck::pod_collect_to_vec(&gpu.device.read(&gpu.cells)?)
            }
        };
        let mut map = HeightMap::empty(spec.width, spec.height, spec.cell, spec.base_from_grid);
        for (i, sums) in cells.iter().enumerate().filter(|(_, sums)| sums.count > 0) {
            if sums.count > COUNT_MOST {
                return Err(Fault::refused(format!(
                    "a cell of {} mm holds {} points, limit {COUNT_MOST}",
                    spec.cell, sums.count
                ))
                .cause("the cell is large against the distance of the points")
                .next("choose a smaller cell_mm"));
            }
            let n = f64::from(sums.count);
            map.count[i] = sums.count;
            map.z[i] = (f64::from(sums.z) / n * f64::from(spec.z_step)) as f32;
            map.intensity[i] = (f64::from(sums.intensity) / n * frame.intensity_step()) as f32;
            map.sigma[i] = (f64::from(sums.sigma) / n * SIGMA_STEP / n.sqrt()) as f32;
        }
        Ok(map)
    }
}

impl Gpu {
    fn new(device: &Device, frame: &GridFrame) -> Result<Gpu> {
        let n = frame.cells() as u64;
        let uniform = device.storage("grid frame", size_of::<GridFrame>() as u64)?;
        let records = device.storage("cloud points", (CHUNK * size_of::<CloudPoint>()) as u64)?;
        // A new buffer is zeroed, and zeros are an empty cell.
        let span_of = device.storage("grid span", 8 * n)?;
        let layers = device.storage("grid layers", 32 * n)?;
        let cells = device.storage("grid cells", 16 * n)?;
        let all = grid::point_groups(CHUNK as u32);
        let [mut span, mut sum, mut pick] = [(); 3].map(|()| Recording::default());
        span.dispatch(device, &grid::SPAN.pipeline(device, &[])?, &[&uniform, &records, &span_of], all);
        sum.dispatch(device, &grid::SUM.pipeline(device, &[])?, &[&uniform, &records, &span_of, &layers], all);
        let each = grid::cell_groups(frame);
        pick.dispatch(device, &grid::PICK.pipeline(device, &[])?, &[&uniform, &span_of, &layers, &cells], each);
        Ok(Gpu {
            device: device.clone(),
            replay: Replay::new(device, false)?,
            uniform,
            records,
            cells,
            span,
            sum,
            pick,
        })
    }

    fn take(&mut self, frame: &GridFrame, pass: Pass, part: &[CloudPoint]) -> Result<()> {
        self.device.write(&self.uniform, 0, bytemuck::bytes_of(frame));
        self.device.write(&self.records, 0, bytemuck::cast_slice(part));
        self.replay.run(&[if pass == Pass::Span { &self.span } else { &self.sum }])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Base, Grid, Rigid, Vec3};
    use crate::scan::grid;
    use crate::scan::{GridOptions, grid_on};

    /// A wavy surface with a second one above part of it, more points than one chunk, far from the base's origin.
    fn surface() -> (Rigid<Base, Grid>, Vec<CloudPoint>) {
        let frame = Rigid::from_vectors(&Vec3::new(0.3, -0.2, 1.0), Vec3::new(800.0, -500.0, 120.0));
        let point = |i: u32| {
            let (x, y) = (0.05 * f64::from(i % 400) + 0.013, 0.05 * f64::from(i / 400) + 0.017);
            let up = if i.is_multiple_of(3) && x > 10.0 { 2.0 } else { 0.0 };
            let p = frame.point(&Vec3::new(x, y, 0.3 * (x / 3.0).sin() + up));
            CloudPoint {
                position: [p.x as f32, p.y as f32, p.z as f32].into(),
                sigma_mm: 0.01 + 0.001 * (i % 7) as f32,
                intensity: 30.0 + (i % 90) as f32,
                quality: (i % 10) as f32 / 9.0,
                shot: i / 400,
                ..CloudPoint::default()
            }
        };
        (frame, (0..150_000).map(point).collect())
    }

    #[test]
    fn gpu_and_twin_fill_the_same_map() {
        let Some(device) = Device::for_tests() else { return };
        let (frame, mut points) = surface();
        let options =
            GridOptions { cell: Some(0.2), base_from_grid: Some(frame), min_quality: 0.3, ..GridOptions::default() };
        let twin = grid(&points, &options).unwrap();
        points.reverse();
        let gpu = grid_on(&points, &options, Some(&device)).unwrap();
        assert!(twin.count.iter().sum::<u32>() > 70_000 && twin.coverage() > 0.9);
        assert_eq!(twin.count, gpu.count);
        let bits = |v: &[f32]| v.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        for (a, b) in [(&twin.z, &gpu.z), (&twin.intensity, &gpu.intensity), (&twin.sigma, &gpu.sigma)] {
            assert!(bits(a) == bits(b));
        }
    }

    #[test]
    fn a_cell_with_more_points_than_its_sums_can_take_is_refused() {
        let (frame, points) = surface();
        let options = GridOptions { cell: Some(50.0), base_from_grid: Some(frame), ..GridOptions::default() };
        let fault = grid(&points, &options).unwrap_err();
        assert!(fault.what.contains("limit 65535") && fault.next.contains("smaller"), "{fault}");
    }
}
