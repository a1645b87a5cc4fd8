//! In: arcs and polylines with bulges. Out: points on them, dense enough that the polyline stays within a given
//! distance.
//! Frame and unit: the drawing's own x y and unit; angles in radians.

/// Largest angle between two points, rad: even a small arc keeps its direction, whatever distance is allowed.
const STEP: f64 = std::f64::consts::TAU / 100.0;

/// Points on an arc from one angle to another, both ends included; the polyline stays within `flat` of the arc.
pub fn arc(centre: [f64; 2], radius: f64, from: f64, to: f64, flat: f64) -> Vec<[f64; 2]> {
    // A chord over an angle a lies up to r a^2 / 8 from its arc. The lower limit suffices for every arc of a part.
    let step = STEP.min((8.0 * flat / radius).sqrt()).max(STEP / 100.0);
    let steps = ((to - from).abs() / step).ceil().max(2.0) as usize;
    (0..=steps)
        .map(|i| {
            let (s, c) = (from + (to - from) * i as f64 / steps as f64).sin_cos();
            [centre[0] + radius * c, centre[1] + radius * s]
        })
        .collect()
}

/// Points on a polyline whose segments may be arcs. The bulge is the tangent of a quarter of the arc's angle, positive
/// where the arc turns left.
pub fn bent(corners: &[([f64; 2], f64)], closed: bool, flat: f64) -> Vec<[f64; 2]> {
    let mut out = Vec::new();
    for (i, &(a, bulge)) in corners.iter().enumerate() {
        out.push(a);
        let Some(&(b, _)) = corners.get(i + 1).or(corners.first().filter(|_| closed)) else { continue };
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let chord = dx.hypot(dy);
        if bulge.abs() < 1e-9 || chord == 0.0 {
            continue;
        }
        let rise = (1.0 - bulge * bulge) / (4.0 * bulge);
        let centre = [0.5 * (a[0] + b[0]) - dy * rise, 0.5 * (a[1] + b[1]) + dx * rise];
        let from = (a[1] - centre[1]).atan2(a[0] - centre[0]);
        let radius = (a[0] - centre[0]).hypot(a[1] - centre[1]);
        let bow = arc(centre, radius, from, from + 4.0 * bulge.atan(), flat);
        out.extend(&bow[1..bow.len() - 1]);
    }
    out
}

/// How far a polyline may lie from the curve it approximates, mm: well below what a scan can resolve.
pub const FLAT: f64 = 0.002;
