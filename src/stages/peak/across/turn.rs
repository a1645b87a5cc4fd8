//! In: the stripe's sigma, and the lattice of grey levels from which its direction is computed. Out: the angle by which
//! the structure tensor's direction must be turned. Frame and unit: sigma and lattice in px; angles in rad from the
//! image's v axis. docs/math.md, Stripe peak (1).

/// Number of angles that the correction is fitted to.
const ANGLES: usize = 12;
/// Stripes up to this many degrees off the image axis keep the lattice that is longer along them; steeper ones use a
/// square lattice.
const FLATTEST: usize = 33;
/// A stripe that is steeper than the last flat one by `STEEPER` degrees must seem steeper by at least `APART`, rad.
/// Noise turns the direction of the tensor by two degrees.
const STEEPER: usize = 5;
const APART: f64 = 3.0 * std::f64::consts::PI / 180.0;

/// Angle of the tensor's strongest direction for a straight Gaussian stripe whose normal is (sin a, cos a).
fn seen(a: f64, s0: f64, (u, v): (i32, i32)) -> f64 {
    let (sin, cos) = a.sin_cos();
    let ratio = f64::from(v) / f64::from(u);
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for place in [0.0, 0.25] {
        let light = |i: i32, j: i32| {
            let z = (f64::from(i * u) * sin + f64::from(j * v) * cos) / s0 + place;
            (-0.5 * z * z).exp()
        };
        for (i, j, weight) in GRADIENTS {
            let gx = ratio * (light(i + 1, j) - light(i - 1, j));
            let gy = light(i, j + 1) - light(i, j - 1);
            xx += f64::from(weight) * (gx * gx);
            xy += f64::from(weight) * (gx * gy);
            yy += f64::from(weight) * (gy * gy);
        }
    }
    0.5 * (2.0 * xy).atan2(yy - xx)
}

/// The steepest angle, rad, of a stripe that keeps the lattice `(along, across)`, and the angle that the tensor shows
/// for it. On stripes narrower than 0.85 px steeper angles seem flatter: at 0.7 px, 45 degrees seem 30.
pub(in crate::stages::peak) fn flattest(s0: f32, lattice: (i32, i32)) -> (f64, f64) {
    let seen: Vec<f64> = (0..=90).map(|a| seen(f64::from(a).to_radians(), f64::from(s0), lattice)).collect();
    let told = |a: &usize| seen[a + STEEPER..].iter().all(|steeper| *steeper > seen[*a] + APART);
    let last = (0..=FLATTEST).rev().find(told).unwrap_or(0);
    ((last as f64).to_radians(), seen[last])
}

/// Differences over nearly three widths are no derivatives, and a lattice that is not square weights them differently.
/// The tensor's direction is therefore off by up to 13 degrees, equally on every stripe. Returns the coefficients c of
/// the correction sum c_k sin(k a) for the multiples `k`, where a is the angle that the tensor shows. They are least
/// squares over the angles from 0 to `up_to`, which count from the u axis if `rows`.
pub(in crate::stages::peak) fn turn<const N: usize>(
    s0: f32,
    lattice: (i32, i32),
    k: [f64; N],
    up_to: f64,
    rows: bool,
) -> [f32; N] {
    let mut normal = nalgebra::SMatrix::<f64, N, N>::zeros();
    let mut right = nalgebra::SVector::<f64, N>::zeros();
    for i in 1..=ANGLES {
        let a = up_to * i as f64 / ANGLES as f64;
        let a = if rows { std::f64::consts::FRAC_PI_2 - a } else { a };
        let seen = seen(a, f64::from(s0), lattice);
        let row = nalgebra::SVector::<f64, N>::from_fn(|j, _| (k[j] * seen).sin());
        normal += row * row.transpose();
        right += row * (a - seen);
    }
    // On a stripe of one pixel the tensor shows the same at every angle: then nothing is corrected.
    normal.cholesky().map_or([0.0; N], |c| std::array::from_fn(|j| c.solve(&right)[j] as f32))
}

/// Weights (1 - r² / 16)² of the gradients in 64ths: in the rows two above and two below the pixel, in its own row, and
/// one step away along both axes.
pub(in crate::stages) const EVEN_ROW: [i32; 3] = [16, 36, 16];
pub(in crate::stages) const MIDDLE_ROW: [i32; 3] = [36, 64, 36];
pub(in crate::stages) const DIAGONAL: i32 = 49;
/// The sum of all 13 weights.
pub(in crate::stages::peak) const WEIGHTS: f32 = (64 + 4 * 49 + 4 * 36 + 4 * 16) as f32;

/// Places of the gradients and their weights. They are every other place of a lattice, like one colour of a chessboard:
/// a gradient uses its four neighbours, which lie on the other colour.
const GRADIENTS: [(i32, i32, i32); 13] = [
    (0, 0, MIDDLE_ROW[1]),
    (-1, -1, DIAGONAL),
    (1, -1, DIAGONAL),
    (-1, 1, DIAGONAL),
    (1, 1, DIAGONAL),
    (0, -2, EVEN_ROW[1]),
    (-2, 0, MIDDLE_ROW[0]),
    (2, 0, MIDDLE_ROW[2]),
    (0, 2, EVEN_ROW[1]),
    (-2, -2, EVEN_ROW[0]),
    (2, -2, EVEN_ROW[2]),
    (-2, 2, EVEN_ROW[0]),
    (2, 2, EVEN_ROW[2]),
];

/// Number of bits by which gradients of a picture with this saturation level are shortened, to ten bits.
pub(in crate::stages::peak) fn deep(full_scale: f32) -> u32 {
    (full_scale as u32).count_ones().max(10) - 10
}
