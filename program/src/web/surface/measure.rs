//! In: a height map and selected points. Out: the distance between two of them, or of one from a plane.
//! Frame and unit: grid frame, mm, degrees.

use super::fit::Surface;
use super::section::cell_at;
use crate::web::message::{Distance, Measure, MeasureAnswer};
use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::Vec3;
use sheetlight::scan::HeightMap;

/// Most cells of a plane that are fitted; of more cells every k-th is used.
const MOST_CELLS: usize = 200_000;

/// Measures. Returns an error for points where nothing was measured, and boxes with fewer than 3 cells or only
/// collinear cells.
pub fn measure(map: &HeightMap, what: &Measure) -> Result<MeasureAnswer> {
    match what {
        Measure::TwoPoints(ask) => two_points(&pointed(map, &ask.a)?, &pointed(map, &ask.b)?),
        Measure::PointToPlane(ask) => point_to_plane(map, &pointed(map, &ask.point)?, &ask.plane),
    }
}

/// A selected point, with its variances.
struct Pointed {
    place: Vec3,
    variance: Vec3,
}

/// The point that a cell defines. Its position in the plane is uncertain by the cell's size.
fn pointed(map: &HeightMap, at: &[f64; 2]) -> Result<Pointed> {
    let Some((z, sigma)) = cell_at(map, at[0], at[1]) else {
        return Err(Fault::refused(format!("nothing was measured at {:.3} {:.3} mm", at[0], at[1]))
            .cause("the cell is missing: shadow, glare, or outside the scan")
            .next("point at a place that has a height"));
    };
    let flat = map.cell * map.cell / 12.0;
    Ok(Pointed { place: Vec3::new(at[0], at[1], z), variance: Vec3::new(flat, flat, sigma * sigma) })
}

fn two_points(a: &Pointed, b: &Pointed) -> Result<MeasureAnswer> {
    let d = b.place - a.place;
    let value = d.norm();
    if value < 1e-9 {
        return Err(Fault::usage("both places are the same").next("point at another one"));
    }
    let unit = d / value;
    let variance = (a.variance + b.variance).dot(&unit.component_mul(&unit));
    Ok(MeasureAnswer {
        distance: Distance { value, sigma: variance.sqrt() },
        along: Some([d.x, d.y, d.z]),
        tilt: None,
        rms_mm: None,
        cells: 2,
    })
}

fn point_to_plane(map: &HeightMap, p: &Pointed, corners: &[f64; 4]) -> Result<MeasureAnswer> {
    let places = in_box(map, corners);
    let Some(plane) = Surface::fit(&places, false) else {
        return Err(Fault::refused(format!("{} measured cells in the box, which make no plane", places.len()))
            .cause("the box is too small, or contains no cells")
            .next("draw a larger box over the surface"));
    };
    let (height, sigma) = plane.at(p.place.x, p.place.y);
    let normal = plane.normal();
    let distance = (p.place.z - height) * normal.z;
    // Variance of the point along the normal, and of the plane below it along the normal.
    let variance = p.variance.dot(&normal.component_mul(&normal)) + (sigma * normal.z).powi(2);
    let slopes = plane.coefficients.fixed_rows::<2>(1).into_owned();
    let steep = slopes.norm();
    let c = plane.covariance.fixed_view::<2, 2>(1, 1).into_owned();
    let along = if steep > 1e-12 { slopes / steep } else { nalgebra::Vector2::x() };
    let tilt_variance = (along.transpose() * c * along)[0].max(0.0) / (1.0 + steep * steep).powi(2);
    Ok(MeasureAnswer {
        distance: Distance { value: distance, sigma: variance.sqrt() },
        along: None,
        tilt: Some(Distance { value: steep.atan().to_degrees(), sigma: tilt_variance.sqrt().to_degrees() }),
        rms_mm: Some(plane.rms),
        cells: places.len(),
    })
}

/// Measured cells in a box.
fn in_box(map: &HeightMap, corners: &[f64; 4]) -> Vec<[f64; 4]> {
    let range = |a: f64, b: f64, most: u32| {
        let at = |mm: f64| (mm / map.cell).floor().clamp(0.0, f64::from(most)) as u32;
        at(a.min(b))..at(a.max(b) + map.cell).min(most)
    };
    let (columns, rows) = (range(corners[0], corners[2], map.width), range(corners[1], corners[3], map.height));
    let every = (columns.len() * rows.len()).div_ceil(MOST_CELLS).max(1);
    let cells = rows.flat_map(|y| columns.clone().map(move |x| (x, y))).step_by(every);
    let place = |(x, y): (u32, u32)| {
        let p = map.point(x, y)?;
        Some([p.x, p.y, p.z, f64::from(map.sigma[y as usize * map.width as usize + x as usize])])
    };
    cells.filter_map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::web::message::{PlaneAsk, PointsAsk};
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};
    use sheetlight::geometry::Rigid;

    /// A plate that rises by 0.1 mm per mm along x, with a step of 5 mm beyond x = 20. The noise of the heights is
    /// 0.02 mm, as they state.
    fn map(seed: u64) -> HeightMap {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
        let noise = Normal::new(0.0, 0.02).unwrap();
        let mut map = HeightMap::empty(80, 40, 0.5, Rigid::identity());
        for (i, z) in map.z.iter_mut().enumerate() {
            let x = (i % 80) as f64 * 0.5 + 0.25;
            *z = (0.1 * x + if x > 20.0 { 5.0 } else { 0.0 } + noise.sample(&mut random)) as f32;
        }
        map.sigma.fill(0.02);
        map.z[0] = f32::NAN;
        map
    }

    #[test]
    fn distances_from_a_plane_scatter_as_they_state() {
        let ask = Measure::PointToPlane(PlaneAsk { point: [30.0, 10.1], plane: [1.0, 1.0, 19.0, 19.0] });
        // Above the extended slope, along its normal. The point represents its cell, whose centre is higher by half
        // a cell times the slope.
        let steep = 1.01f64.sqrt();
        let (mut sum, mut stated) = (0.0, 0.0);
        for seed in 0..400 {
            let a = measure(&map(seed), &ask).unwrap();
            sum += (a.distance.value - (5.0 + 0.025) / steep).powi(2);
            stated = a.distance.sigma;
            assert!((a.tilt.unwrap().value - 0.1f64.atan().to_degrees()).abs() < 0.1);
        }
        let scatter = (sum / 400.0).sqrt();
        // Here the point's position in the plane is exact, but its stated variance includes 0.5 mm / sqrt 12 times
        // the slope.
        let in_plane = 0.5 / 12f64.sqrt() * 0.1 / steep;
        let expected = (stated * stated - in_plane * in_plane).sqrt();
        assert!((0.85..1.15).contains(&(scatter / expected)), "{scatter} against {expected}");
    }

    #[test]
    fn what_was_not_seen_is_refused() {
        let ask = |a, b| measure(&map(1), &Measure::TwoPoints(PointsAsk { a, b }));
        assert!(ask([0.1, 0.1], [5.0, 5.0]).unwrap_err().what.contains("nothing was measured"));
        assert!(ask([-1.0, 3.0], [5.0, 5.0]).is_err() && ask([f64::NAN, 3.0], [5.0, 5.0]).is_err());
        let d = ask([5.25, 5.25], [35.25, 5.25]).unwrap();
        assert!((d.distance.value - 30f64.hypot(8.0)).abs() < 0.1 && d.distance.sigma > 0.0);
        let plane = Measure::PointToPlane(PlaneAsk { point: [30.0, 10.0], plane: [3.0, 3.0, 3.1, 9.0] });
        assert!(measure(&map(1), &plane).unwrap_err().what.contains("no plane"));
    }
}
