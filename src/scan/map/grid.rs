//! In: a cloud (in memory or on disk) and a choice of grid. Out: a height map whose cells hold the mean of their
//! points (stages::grid). A cell with two surfaces takes the one with more points.
//! Frame and unit: points in the base frame, mm; the grid's frame is the scan's best plane unless given.

use super::filling::{Filling, Pass};
use super::spec::{GridOptions, choose};
use crate::fault::Result;
use crate::gpu::Device;
use crate::scan::{HeightMap, PointSource};

/// Grids a cloud on the CPU. Refuses an empty cloud and grids of more than 64 million cells.
pub fn grid(source: &(impl PointSource + ?Sized), options: &GridOptions) -> Result<HeightMap> {
    grid_on(source, options, None)
}

/// As [`grid`], on a GPU if one is given and its buffers can hold the grid; the cells are the same.
pub fn grid_on(
    source: &(impl PointSource + ?Sized),
    options: &GridOptions,
    device: Option<&Device>,
) -> Result<HeightMap> {
    options.check()?;
    let spec = choose(source, options)?;
    let mut filling = Filling::new(&spec, options.min_quality, device)?;
    for pass in [Pass::Span, Pass::Sum] {
        let mut fault = None;
        source.for_each_chunk(&mut |chunk| {
            if fault.is_none() {
                fault = filling.take(pass, chunk).err();
            }
        })?;
        if let Some(fault) = fault {
            return Err(fault);
        }
    }
    filling.resolve(&spec)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Base, Grid, Rigid, Vec3};
    use crate::scan::CloudPoint;

    /// A plate with a raised square, in a tilted frame, points on a 0.2 mm raster.
    fn plate(tilt: &Rigid<Base, Grid>) -> Vec<CloudPoint> {
        let mut out = Vec::new();
        for i in 0..200 {
            for j in 0..150 {
                let (x, y) = (0.2 * f64::from(i) + 0.013, 0.2 * f64::from(j) + 0.017);
                let z = if (10.0..20.0).contains(&x) && (8.0..18.0).contains(&y) { 3.0 } else { 0.0 };
                let p = tilt.point(&Vec3::new(x, y, z));
                out.push(CloudPoint {
                    position: [p.x as f32, p.y as f32, p.z as f32].into(),
                    sigma_mm: 0.02,
                    intensity: 80.0,
                    quality: 1.0,
                    ..Default::default()
                });
            }
        }
        out
    }

    #[test]
    fn the_best_plane_is_the_plate_and_heights_are_above_it() {
        let tilt = Rigid::from_vectors(&Vec3::new(0.2, -0.1, 0.3), Vec3::new(400.0, -100.0, 60.0));
        let map = grid(&plate(&tilt), &GridOptions::default()).unwrap();
        let normal = map.base_from_grid.direction(&Vec3::z());
        assert!(normal.dot(&tilt.direction(&Vec3::z())) > 1.0 - 1e-9);
        let measured: Vec<f32> = map.z.iter().copied().filter(|z| z.is_finite()).collect();
        assert!(measured.iter().all(|z| z.abs() < 2e-3 || (z - 3.0).abs() < 2e-3), "no cell between the surfaces");
        let high = measured.iter().filter(|z| **z > 1.5).count() as f64 / measured.len() as f64;
        assert!((high - 100.0 / 1200.0).abs() < 0.01, "{high}");
    }

    #[test]
    fn points_on_a_raster_as_fine_as_the_cells_fill_each_cell_once() {
        for cell in [0.2, 0.1, 0.4] {
            let options = GridOptions { cell: Some(cell), ..Default::default() };
            for turn in [0.0, 1.0, 30.0f64] {
                let place = Rigid::from_vectors(&Vec3::new(0.0, turn.to_radians(), 0.0), Vec3::new(28.3, -31.7, 5.0));
                let map = grid(&plate(&place), &options).unwrap();
                let (points, cells) = (200.0 * 150.0, f64::from(map.width) * f64::from(map.height));
                // Of finer cells most are empty; each point still has one of its own.
                let least = if cell < 0.2 { 1 } else { (cell / 0.2).round().powi(2) as u32 };
                let full = map.count.iter().filter(|n| **n == least).count() as f64;
                let share = full / if cell < 0.2 { points } else { cells };
                assert!(share > 0.97, "cells of {cell} mm, {turn} degrees: {share} of them hold {least}");
            }
        }
    }

    #[test]
    fn a_given_grid_is_filled_exactly() {
        let frame = Rigid::<Base, Grid>::identity();
        let options =
            GridOptions { cell: Some(0.4), base_from_grid: Some(frame), cells: Some([100, 75]), ..Default::default() };
        let map = grid(&plate(&frame), &options).unwrap();
        assert_eq!((map.width, map.height), (100, 75));
        assert!(map.count.iter().all(|&n| n == 4));
        assert!((map.get(26, 21).unwrap() - 3.0).abs() < 1e-3 && map.get(5, 5).unwrap().abs() < 1e-3);
        assert!((map.sigma[0] - 0.01).abs() < 1e-6 && (map.intensity[0] - 80.0).abs() < 1e-3);
    }

    #[test]
    fn empty_cells_are_missing_and_the_order_does_not_matter() {
        let frame = Rigid::<Base, Grid>::identity();
        let mut points = plate(&frame);
        points.retain(|p| p.position[0] < 15.0 || p.position[0] > 16.0);
        let options = GridOptions { cell: Some(0.5), base_from_grid: Some(frame), ..Default::default() };
        let a = grid(&points, &options).unwrap();
        points.reverse();
        let b = grid(&points, &options).unwrap();
        assert!(a.z.iter().zip(&b.z).all(|(x, y)| x.to_bits() == y.to_bits()));
        assert_eq!(a.get(31, 20), None);
        assert!(a.z[20 * a.width as usize + 31].is_nan());
    }

    #[test]
    fn a_huge_grid_and_an_empty_cloud_are_refused() {
        let options = GridOptions { cell: Some(0.005), ..Default::default() };
        let tilt = Rigid::<Base, Grid>::identity();
        let mut points = plate(&tilt);
        for p in &mut points {
            p.position[0] *= 40.0;
        }
        assert!(grid(&points, &options).unwrap_err().what.contains("limit"));
        assert!(grid(&Vec::new(), &GridOptions::default()).is_err());
        assert!(GridOptions { cell: Some(0.0), ..Default::default() }.check().is_err());
    }
}
