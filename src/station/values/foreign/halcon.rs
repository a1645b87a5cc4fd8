//! HALCON's camera parameters (`write_cam_par`): lengths in metres, a lens polynomial that maps the distorted
//! picture to the ideal one.

use crate::camera::{Distortion, Intrinsics};
use crate::fault::{Fault, Result};
use nalgebra::{SMatrix, SVector};
use std::collections::BTreeMap;

/// Largest difference over the picture between HALCON's polynomial and its fitted inverse, px.
const FAITHFUL: f64 = 0.05;

/// Whether a file holds HALCON's parameters.
pub fn is_one(text: &str) -> bool {
    text.contains("ParGroup:")
        && text.contains("Camera")
        && ["Focus:", "Magnification:"].iter().any(|k| text.contains(k))
}

/// Parameters by name: `Focus:foc: 0.008;`.
fn parameters(text: &str) -> BTreeMap<String, f64> {
    let statement = |s: &str| {
        let body: Vec<&str> =
            s.lines().map(|l| l.split('#').next().unwrap_or("").trim()).filter(|l| !l.is_empty()).collect();
        let line = body.join(" ");
        let mut parts = line.rsplitn(2, ':');
        let value: f64 = parts.next()?.trim().trim_matches('"').parse().ok()?;
        let name = parts.next()?.split(':').next()?.split_whitespace().last()?.to_owned();
        Some((name, value))
    };
    text.split(';').filter_map(statement).collect()
}

/// The camera, and a remark on how the file was read.
pub fn camera(text: &str) -> Result<(Intrinsics, String)> {
    let all = parameters(text);
    let of = |names: &[&str]| names.iter().find_map(|n| all.get(*n).copied());
    let need = |names: &[&str]| {
        of(names).ok_or_else(|| {
            Fault::input(format!("has no {}", names[0]))
                .cause("camera parameters of another type: line scan, telecentric or tilted")
                .next("write the parameters of an area-scan camera with a perspective lens")
        })
    };
    if let Some(by) = all.get("Magnification") {
        return Err(Fault::input(format!("a telecentric camera (Magnification {by}), which is not supported"))
            .cause("its rays are parallel; the cameras here see from one point")
            .next("use an area-scan camera with a perspective lens"));
    }
    if let Some(other) = ["Tilt", "Rot", "Vx", "ImagePlaneDist"].iter().find(|n| all.contains_key(**n)) {
        return Err(Fault::input(format!("has the parameter {other}"))
            .cause("camera parameters of another type: line scan, telecentric or tilted")
            .next("write the parameters of an area-scan camera with a perspective lens"));
    }
    let kappa = of(&["Kappa"]).unwrap_or(0.0);
    if kappa != 0.0 {
        return Err(Fault::input(format!("kappa is {kappa}: HALCON's division model"))
            .cause("its one term divides, and no finite number of the terms that are known here says the same")
            .next(
                "calibrate in HALCON with the polynomial model (area_scan_polynomial), or here: sheetlight \
                 calibrate camera",
            ));
    }
    let [focus, sx, sy] = [need(&["Focus"])?, need(&["Sx"])?, need(&["Sy"])?];
    let [cx, cy] = [need(&["Cx"])?, need(&["Cy"])?];
    let [width, height] = [need(&["ImageWidth"])?, need(&["ImageHeight"])?].map(|n| n as u32);
    if !(focus > 0.0 && sx > 0.0 && sy > 0.0) {
        return Err(Fault::input(format!("focus {focus}, pixels of {sx} x {sy} m, all must be above 0"))
            .cause("a telecentric lens, whose focus HALCON writes as 0, or a damaged file")
            .next("write the parameters of an area-scan camera with a perspective lens"));
    }
    const POLYNOMIAL: [[&str; 2]; 5] =
        [["Poly1", "K1"], ["Poly2", "K2"], ["Poly3", "K3"], ["Poly4", "P1"], ["Poly5", "P2"]];
    let [k1, k2, k3, p1, p2] = POLYNOMIAL;
    // A file of the division model has kappa only; kappa = 0 states a lens without distortion.
    let divides = all.contains_key("Kappa") && POLYNOMIAL.iter().all(|names| of(names).is_none());
    let terms = if divides { [0.0; 5] } else { [need(&k1)?, need(&k2)?, need(&k3)?, need(&p1)?, need(&p2)?] };
    let plain = Intrinsics {
        fx: focus / sx,
        fy: focus / sy,
        cx,
        cy,
        skew: 0.0,
        distortion: Distortion::default(),
        width,
        height,
    };
    let (distortion, off) = forward(&plain, focus, terms)?;
    let said = if terms == [0.0; 5] {
        "read as HALCON writes it: no lens terms, (0, 0) is the centre of a pixel".into()
    } else {
        format!(
            "read as HALCON writes it: its polynomial leads from the picture to the ideal one; the way back as k1 k2 \
             p1 p2 k3 is the same to {off:.4} px"
        )
    };
    Ok((Intrinsics { distortion, ..plain }, said))
}

/// Fits the terms that map to the distorted picture; also returns their largest error, px.
fn forward(plain: &Intrinsics, focus: f64, [k1, k2, k3, p1, p2]: [f64; 5]) -> Result<(Distortion, f64)> {
    let mut pairs = Vec::new();
    const CELLS: u32 = 24;
    for j in 0..=CELLS {
        for i in 0..=CELLS {
            let u = f64::from(i) / f64::from(CELLS) * f64::from(plain.width) - 0.5;
            let v = f64::from(j) / f64::from(CELLS) * f64::from(plain.height) - 0.5;
            // HALCON's polynomial is in metres on the sensor.
            let [x, y] = [(u - plain.cx) / plain.fx, (v - plain.cy) / plain.fy];
            let [a, b] = [x * focus, y * focus];
            let r2 = a * a + b * b;
            let radial = r2 * (k1 + r2 * (k2 + r2 * k3));
            let ideal = [
                a + a * radial + p1 * (r2 + 2.0 * a * a) + 2.0 * p2 * a * b,
                b + b * radial + 2.0 * p1 * a * b + p2 * (r2 + 2.0 * b * b),
            ];
            pairs.push((ideal.map(|m| m / focus), [x, y]));
        }
    }
    // The displacement is linear in the terms.
    let (mut h, mut g) = (SMatrix::<f64, 5, 5>::zeros(), SVector::<f64, 5>::zeros());
    for ([x, y], seen) in &pairs {
        let r2 = x * x + y * y;
        for (at, p, moved) in
            [(x, [2.0 * x * y, r2 + 2.0 * x * x], seen[0] - x), (y, [r2 + 2.0 * y * y, 2.0 * x * y], seen[1] - y)]
        {
            let row = SVector::<f64, 5>::new(at * r2, at * r2 * r2, p[0], p[1], at * r2 * r2 * r2);
            h += row * row.transpose();
            g += row * moved;
        }
    }
    let terms = h.try_inverse().map(|inverse| inverse * g).filter(|t| t.iter().all(|x| x.is_finite()));
    let terms = terms.ok_or_else(|| unfaithful(f64::INFINITY))?;
    let distortion = Distortion::from_opencv(terms.as_slice()).expect("five terms");
    let camera = Intrinsics { distortion, ..*plain };
    let off = pairs
        .iter()
        .map(|([x, y], seen)| {
            let at = camera.pixel_from_point(&crate::geometry::Vec3::new(*x, *y, 1.0));
            let wanted = [seen[0] * plain.fx + plain.cx, seen[1] * plain.fy + plain.cy];
            at.map_or(f64::INFINITY, |p| (p.x - wanted[0]).hypot(p.y - wanted[1]))
        })
        .fold(0.0, f64::max);
    if off <= FAITHFUL { Ok((distortion, off)) } else { Err(unfaithful(off)) }
}

fn unfaithful(off: f64) -> Fault {
    Fault::input(format!(
        "HALCON's polynomial cannot be turned round: the way back is off by {off:.2} px, at most {FAITHFUL} are taken"
    ))
    .cause("a lens that bends strongly, or terms of another file")
    .next("calibrate here: sheetlight calibrate camera")
}
