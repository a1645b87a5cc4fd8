//! In: places of one part that stood still, each with what it said of itself. Out: how far they lie apart along each
//! axis of their frame and in the turn, beside that. Pure.
//! Frame and unit: the scans' frame; mm, degrees; one standard deviation.

use crate::geometry::{Base, Part, Rigid};

/// Bars of a histogram.
const BARS: usize = 15;

/// A place that was found.
#[derive(Clone, Debug)]
pub struct Placed {
    /// Where.
    pub base_from_part: Rigid<Base, Part>,
    /// One standard deviation along the part's axes, mm.
    pub sigma_mm: [f64; 3],
    /// Of its turn about the part's z, degrees.
    pub sigma_turn_deg: f64,
}

impl Placed {
    /// Of a place as reports write it: row-major 4x4, mm, sigmas along and about the part's axes. `None`: it is no
    /// place.
    pub fn of(part: &[f64; 16], sigma_mm: [f64; 3], sigma_deg: [f64; 3]) -> Option<Placed> {
        let base_from_part = Rigid::from_rows(part).ok()?.0;
        Some(Placed { base_from_part, sigma_mm, sigma_turn_deg: sigma_deg[2] })
    }
}

/// How places repeat along one axis, or in the turn.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Spread {
    /// x, y, z of the frame, or turn.
    pub name: &'static str,
    /// mm or degrees.
    pub unit: &'static str,
    /// Of each place from the median.
    pub deviations: Vec<f64>,
    /// One standard deviation of the places.
    pub scatter: f64,
    /// What they state: root mean square of their own.
    pub stated: f64,
    /// Between the two extremes.
    pub apart: f64,
    /// The histogram reaches so far to both sides of the median.
    pub half: f64,
    /// Places in each of its bars, from low to high.
    pub bars: Vec<u32>,
}

/// How places repeat.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Repeats {
    /// Of how many.
    pub places: usize,
    /// x, y, z, turn.
    pub along: Vec<Spread>,
}

/// How they repeat; `None` of fewer than two.
pub fn repeats(places: &[Placed]) -> Option<Repeats> {
    let first = places.first().filter(|_| places.len() > 1)?;
    let along = |k: usize| {
        let at: Vec<f64> = places.iter().map(|p| p.base_from_part.translation[k]).collect();
        // The part's own sigmas, along an axis of the frame.
        let own = |p: &Placed| (0..3).map(|j| (p.base_from_part.rotation[(k, j)] * p.sigma_mm[j]).powi(2)).sum::<f64>();
        spread(["x", "y", "z"][k], "mm", at, places.iter().map(own))
    };
    // Against the first one, so that none is cut in two at half a turn.
    let turn = |p: &Placed| {
        let r = first.base_from_part.rotation.transpose() * p.base_from_part.rotation;
        r[(1, 0)].atan2(r[(0, 0)]).to_degrees()
    };
    let turned =
        spread("turn", "degrees", places.iter().map(turn).collect(), places.iter().map(|p| p.sigma_turn_deg.powi(2)));
    Some(Repeats { places: places.len(), along: (0..3).map(along).chain([turned]).collect() })
}

fn spread(name: &'static str, unit: &'static str, values: Vec<f64>, variances: impl Iterator<Item = f64>) -> Spread {
    let n = values.len() as f64;
    let mut sorted = values.clone();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    let median = if sorted.len() % 2 == 1 { sorted[middle] } else { (sorted[middle - 1] + sorted[middle]) / 2.0 };
    let mean = values.iter().sum::<f64>() / n;
    let deviations: Vec<f64> = values.iter().map(|v| v - median).collect();
    let half = deviations.iter().fold(1e-6, |m: f64, d| m.max(d.abs()));
    let mut bars = vec![0; BARS];
    for d in &deviations {
        bars[(((d / half + 1.0) / 2.0 * BARS as f64) as usize).min(BARS - 1)] += 1;
    }
    Spread {
        name,
        unit,
        scatter: (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt(),
        stated: (variances.sum::<f64>() / n).sqrt(),
        apart: sorted[sorted.len() - 1] - sorted[0],
        half,
        bars,
        deviations,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;

    #[test]
    fn places_scatter_as_they_were_put() {
        // Turned by about half a turn, where angles jump; the part's x lies along the frame's y.
        let put = |x: f64, turn_deg: f64| Placed {
            base_from_part: Rigid::from_vectors(&Vec3::new(0.0, 0.0, turn_deg.to_radians()), Vec3::new(x, 5.0, -1.0)),
            sigma_mm: [0.03, 0.04, 0.05],
            sigma_turn_deg: 0.2,
        };
        let r = repeats(&[put(1.0, 179.9), put(1.2, -179.9), put(1.1, 180.0)]).unwrap();
        let [x, y, z, turn] = &r.along[..] else { panic!("{r:?}") };
        assert!((x.scatter - 0.1).abs() < 1e-12 && (x.apart - 0.2).abs() < 1e-12, "{x:?}");
        assert!((turn.scatter - 0.1).abs() < 1e-9 && (turn.apart - 0.2).abs() < 1e-9, "{turn:?}");
        assert!(y.scatter < 1e-12 && (z.stated - 0.05).abs() < 1e-12 && (turn.stated - 0.2).abs() < 1e-12);
        assert_eq!((x.bars[0], x.bars[7], x.bars[14], x.bars.iter().sum::<u32>()), (1, 1, 1, 3));
        let quarter = [put(1.0, 90.0), put(1.0, 90.0)];
        let r = repeats(&quarter).unwrap();
        assert!((r.along[0].stated - 0.04).abs() < 1e-12 && (r.along[1].stated - 0.03).abs() < 1e-12, "{r:?}");
        assert!(repeats(&quarter[..1]).is_none());
    }
}
