//! In: a height map, a line over it, pieces of that line. Out: heights along it, straight lines fitted to the
//! pieces, the step and the angle between them.
//! Frame and unit: grid frame, mm, degrees.

use super::fit::Surface;
use crate::web::message::{Distance, Fit, Section, SectionAsk, SectionPoint};
use sheetlight::fault::{Fault, Result};
use sheetlight::scan::HeightMap;

/// Most points of a section; in a longer one they are farther apart.
const MOST: usize = 8192;

/// Samples the map at every half cell. Returns an error for a line shorter than a cell, numbers that are not
/// finite, more than two pieces, or pieces with fewer than two cells.
pub fn section(map: &HeightMap, ask: &SectionAsk) -> Result<Section> {
    let [dx, dy] = [ask.to[0] - ask.from[0], ask.to[1] - ask.from[1]];
    let length = dx.hypot(dy);
    if !(length > map.cell && length < 1e6) {
        return Err(Fault::usage(format!(
            "the section is {length:.4} mm long, more than a cell of {} mm is needed",
            map.cell
        ))
        .next("draw a longer line"));
    }
    let steps = ((2.0 * length / map.cell).ceil() as usize).clamp(2, MOST);
    let points: Vec<SectionPoint> = (0..=steps)
        .map(|k| {
            let s = length * k as f64 / steps as f64;
            let (x, y) = (ask.from[0] + dx * s / length, ask.from[1] + dy * s / length);
            let cell = cell_at(map, x, y);
            SectionPoint { s, z: cell.map(|c| c.0), sigma: cell.map(|c| c.1) }
        })
        .collect();
    if ask.fits.len() > 2 {
        return Err(Fault::usage(format!("{} pieces, at most 2 are compared", ask.fits.len())).next("take one away"));
    }
    let lines = ask.fits.iter().map(|piece| line(map, ask, piece, length)).collect::<Result<Vec<_>>>()?;
    let fits = ask.fits.iter().zip(&lines).map(|(piece, l)| described(*piece, l)).collect();
    let (step, angle) = match &lines[..] {
        [a, b] => (Some(step(a, b)), Some(between(a, b))),
        _ => (None, None),
    };
    Ok(Section { length_mm: length, points, fits, step, angle })
}

/// Height and standard deviation of the cell that contains a point; `None` outside the map, and for coordinates
/// that are not finite.
pub(super) fn cell_at(map: &HeightMap, x: f64, y: f64) -> Option<(f64, f64)> {
    if !(x.is_finite() && y.is_finite()) {
        return None;
    }
    let (ix, iy) = ((x / map.cell).floor() as i64, (y / map.cell).floor() as i64);
    let z = map.get(ix, iy)?;
    Some((f64::from(z), f64::from(map.sigma[iy as usize * map.width as usize + ix as usize])))
}

/// The line through the cells below a piece; each cell counts once, however often the section samples it.
fn line(map: &HeightMap, ask: &SectionAsk, piece: &[f64; 2], length: f64) -> Result<Surface> {
    let (from, to) = (piece[0].min(piece[1]).max(0.0), piece[0].max(piece[1]).min(length));
    let along = [(ask.to[0] - ask.from[0]) / length, (ask.to[1] - ask.from[1]) / length];
    let mut places: Vec<[f64; 4]> = Vec::new();
    let mut last = None;
    let steps = ((4.0 * (to - from) / map.cell).ceil().max(0.0) as usize).min(4 * MOST);
    for k in 0..=steps {
        let s = from + (to - from) * k as f64 / steps.max(1) as f64;
        let (x, y) = (ask.from[0] + along[0] * s, ask.from[1] + along[1] * s);
        let here = ((x / map.cell).floor() as i64, (y / map.cell).floor() as i64);
        if last.replace(here) == Some(here) {
            continue;
        }
        if let Some((z, sigma)) = cell_at(map, x, y) {
            // Position of the cell's centre along the section.
            let middle =
                [(here.0 as f64 + 0.5) * map.cell - ask.from[0], (here.1 as f64 + 0.5) * map.cell - ask.from[1]];
            places.push([middle[0] * along[0] + middle[1] * along[1], 0.0, z, sigma]);
        }
    }
    Surface::fit(&places, true).ok_or_else(|| {
        Fault::refused(format!("{} measured cells between {from:.3} and {to:.3} mm, 2 are needed", places.len()))
            .cause("the piece contains no cells, or is shorter than a cell")
            .next("draw it longer, over measured ground")
    })
}

fn described(piece: [f64; 2], l: &Surface) -> Fit {
    let slope = l.coefficients[1];
    Fit {
        piece,
        height_mm: l.coefficients[0],
        height_sigma_mm: l.covariance[(0, 0)].max(0.0).sqrt(),
        angle_deg: slope.atan().to_degrees(),
        angle_sigma_deg: (l.covariance[(1, 1)].max(0.0).sqrt() / (1.0 + slope * slope)).to_degrees(),
        rms_mm: l.rms,
        places: l.places,
    }
}

/// From the first line, extended, to the middle of the second piece, at right angles to the first.
fn step(a: &Surface, b: &Surface) -> Distance {
    let (height, sigma) = a.at(b.middle[0], 0.0);
    let steep = 1.0 / (1.0 + a.coefficients[1].powi(2)).sqrt();
    let own = b.covariance[(0, 0)].max(0.0);
    Distance { value: (b.coefficients[0] - height) * steep, sigma: (sigma * sigma + own).sqrt() * steep }
}

fn between(a: &Surface, b: &Surface) -> Distance {
    let of = |l: &Surface| {
        let m = l.coefficients[1];
        (m.atan(), l.covariance[(1, 1)].max(0.0) / (1.0 + m * m).powi(2))
    };
    let ((x, vx), (y, vy)) = (of(a), of(b));
    Distance { value: (y - x).to_degrees(), sigma: (vx + vy).sqrt().to_degrees() }
}
