//! In: the pixels of a feature's fit, their residuals and derivatives. Out: the variance of the fitted position,
//! without an assumption that all pixels have the same noise (docs/math.md, Corners (6)).
//! Frame and unit: pixels; grey levels.

use nalgebra::SMatrix;

/// Variance of the fitted position (parameters 0 and 1 of N), mean of both axes, px².
///
/// The information about the position comes from the pixels on the edges, which are noisier than the plain ones.
/// Print is rough there, the blur model is never exact, and neighbouring pixels share light. With one variance for
/// all pixels, the sigma was 1.65 times too small on rendered pictures. Each pixel's own residual therefore stands
/// for its noise, and products with the eight neighbours for the noise that they share. The division by 1 - h
/// compensates for the part of the residual that the fit absorbed (\[white80\], \[mackinnon85\]; neighbours as in
/// \[conley99\]).
///
/// `pixels` hold x, y (integer steps apart) and grey. `at` gives a pixel's residual and derivatives. `inverse` is the
/// inverse of the matrix of the normal equations.
pub fn place_variance<const N: usize>(
    pixels: &[[f64; 3]],
    inverse: &SMatrix<f64, N, N>,
    mut at: impl FnMut(&[f64; 3]) -> (f64, [f64; N]),
) -> f64 {
    let low = |axis: usize| pixels.iter().map(|p| p[axis]).fold(f64::INFINITY, f64::min);
    let high = |axis: usize| pixels.iter().map(|p| p[axis]).fold(f64::NEG_INFINITY, f64::max);
    let (x0, y0) = (low(0), low(1));
    // A rim of one pixel, so that every pixel has eight neighbours.
    let (width, height) = ((high(0) - x0).round() as usize + 3, (high(1) - y0).round() as usize + 3);
    let mut pull = vec![[0.0f64; 2]; width * height];
    let place = |p: &[f64; 3]| ((p[1] - y0).round() as usize + 1) * width + (p[0] - x0).round() as usize + 1;
    for p in pixels {
        let (residual, row) = at(p);
        let (mut leverage, mut moves) = (0.0, [0.0; 2]);
        for i in 0..N {
            let c: f64 = (0..N).map(|k| inverse[(i, k)] * row[k]).sum();
            leverage += row[i] * c;
            if i < 2 {
                moves[i] = c;
            }
        }
        let free = residual / (1.0 - leverage).max(0.1);
        pull[place(p)] = moves.map(|m| m * free);
    }
    let (mut own, mut shared) = (0.0, 0.0);
    for p in pixels {
        let here = place(p);
        let a = pull[here];
        own += a[0] * a[0] + a[1] * a[1];
        for row in [here - width, here, here + width] {
            for b in &pull[row - 1..=row + 1] {
                shared += a[0] * b[0] + a[1] * b[1];
            }
        }
    }
    // Neighbours with opposite noise (sharpening) must not make a position more certain than independent pixels
    // would.
    0.5 * shared.max(own)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    /// rms of the shift of a known pattern, fitted by least squares, over its reported sigma.
    fn pull(noise: impl Fn(&mut rand_pcg::Pcg64) -> Vec<f64>) -> f64 {
        let slope = |x: f64, y: f64| [(-0.5 * (x - 6.0) * (x - 6.0)).exp(), (-0.5 * (y - 6.0) * (y - 6.0)).exp()];
        let places: Vec<[f64; 2]> = (0..169).map(|k| [f64::from(k % 13), f64::from(k / 13)]).collect();
        let rows: Vec<[f64; 2]> = places.iter().map(|p| slope(p[0], p[1])).collect();
        let mut h = SMatrix::<f64, 2, 2>::zeros();
        rows.iter().for_each(|r| h += SMatrix::<f64, 2, 2>::from_fn(|i, j| r[i] * r[j]));
        let c = h.try_inverse().unwrap();
        let (mut sum, runs) = (0.0, 400);
        for seed in 0..runs {
            let grey = noise(&mut rand_pcg::Pcg64::seed_from_u64(seed));
            let g = rows.iter().zip(&grey).fold([0.0; 2], |g, (r, v)| [g[0] + r[0] * v, g[1] + r[1] * v]);
            let shift = [0, 1].map(|i| c[(i, 0)] * g[0] + c[(i, 1)] * g[1]);
            let pixels: Vec<[f64; 3]> = places.iter().zip(&grey).map(|(p, v)| [p[0], p[1], *v]).collect();
            let variance = place_variance(&pixels, &c, |p| {
                let row = slope(p[0], p[1]);
                (p[2] - row[0] * shift[0] - row[1] * shift[1], row)
            });
            sum += 0.5 * (shift[0] * shift[0] + shift[1] * shift[1]) / variance;
        }
        (sum / runs as f64).sqrt()
    }

    fn draw(rng: &mut rand_pcg::Pcg64) -> f64 {
        StandardNormal.sample(rng)
    }

    #[test]
    fn sigmas_hold_for_even_noise_noisy_edges_and_shared_light() {
        let even = pull(|rng| (0..169).map(|_| draw(rng)).collect());
        let edges = pull(|rng| {
            let on_edge = |k: usize| (k % 13).abs_diff(6) < 2 || (k / 13).abs_diff(6) < 2;
            (0..169).map(|k| draw(rng) * if on_edge(k) { 3.0 } else { 0.5 }).collect()
        });
        // Each pixel shares light with the one to its right and the one below.
        let shared = pull(|rng| {
            let white: Vec<f64> = (0..14 * 14).map(|_| draw(rng)).collect();
            (0..169).map(|k| k % 13 + k / 13 * 14).map(|k| white[k] + 0.5 * (white[k + 1] + white[k + 14])).collect()
        });
        println!("even {even:.3}, noisy edges {edges:.3}, shared light {shared:.3}");
        for pull in [even, edges, shared] {
            assert!((0.8..=1.25).contains(&pull), "even {even:.3}, edges {edges:.3}, shared {shared:.3}");
        }
    }
}
