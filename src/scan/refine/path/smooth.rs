//! In: numbers along a path, relative to each of its poses. Out: the distance of each pose from the smooth path
//! through its neighbours.
//! Frame and unit: the caller's; docs/math.md, Places that scatter (1) and (2).

use crate::solve::robust_scale;

/// Half windows, in shots to each side.
const WINDOWS: [usize; 6] = [2, 4, 8, 16, 32, 64];
/// A wider window is used while its result lies within this many standard deviations of the results of all narrower
/// ones.
const AGREE: f64 = 2.0;
/// A pose that deviates by more standard deviations than this is at a jump of the path, which is no scatter.
const JUMP: f64 = 4.0;

/// Half window over which the departures have their mean and slope removed.
const BEND: usize = 16;

/// Largest distance, in list entries, over which poses are compared.
pub(super) const REACH: usize = WINDOWS[WINDOWS.len() - 1];

/// One pose's neighbourhood: the distance along the path, and the numbers of each neighbour minus those of the pose.
pub(super) type Around<const N: usize> = Vec<(f64, [f64; N])>;

/// Scatter of poses about a smooth path.
pub(super) struct Departures<const N: usize> {
    /// As returned by [`scatter`].
    pub sigma: [f64; N],
    /// Smooth path minus pose, for each pose.
    pub off: Vec<[f64; N]>,
}

/// Scatter of each number of a pose about the straight line through its two neighbours: the standard deviation of
/// one pose.
pub(super) fn scatter<const N: usize>(places: usize, around: impl Fn(usize, usize) -> Around<N>) -> [f64; N] {
    let near: Vec<[f64; N]> = (1..places.saturating_sub(1)).filter_map(|k| off_the_chord(&around(k, 1))).collect();
    std::array::from_fn(|i| robust_scale(&mut near.iter().map(|off| off[i].abs()).collect::<Vec<f64>>(), 1))
}

/// `around(k, reach)` lists the poses up to `reach` before and after pose k, including k itself at distance 0. Lines
/// are fitted in windows that grow until they disagree with narrower ones: intersection of confidence intervals
/// [goldenshluger97]. Bends of the path are therefore preserved.
pub(super) fn departures<const N: usize>(places: usize, around: impl Fn(usize, usize) -> Around<N>) -> Departures<N> {
    let sigma = scatter(places, &around);
    let off: Vec<[f64; N]> = (0..places).map(|k| smoothed(&around(k, REACH), sigma)).collect();
    let off = (0..places).map(|k| scattered(&off, k)).collect();
    Departures { sigma, off }
}

/// The part of a departure that is scatter. A bend that a window cut short is in all departures around it alike, and
/// the surface cannot distinguish it from its own height. The departures are smoothed once more and the result is
/// subtracted (Tukey's twicing).
fn scattered<const N: usize>(off: &[[f64; N]], k: usize) -> [f64; N] {
    let near = k.saturating_sub(BEND)..(k + BEND + 1).min(off.len());
    let window: Vec<(f64, [f64; N])> = near.map(|j| (j as f64 - k as f64, off[j])).collect();
    let smooth = line_at_zero(&window).map_or([0.0; N], |(smooth, _)| smooth);
    std::array::from_fn(|i| off[k][i] - smooth[i])
}

/// Distance of the middle one of three poses from the line through the others, scaled to the scatter of a single
/// pose.
fn off_the_chord<const N: usize>(three: &Around<N>) -> Option<[f64; N]> {
    let [(a, before), _, (b, after)] = three[..] else { return None };
    let (before_counts, after_counts) = (b / (b - a), -a / (b - a));
    let all = (1.0 + before_counts * before_counts + after_counts * after_counts).sqrt();
    Some(std::array::from_fn(|i| (before_counts * before[i] + after_counts * after[i]) / all))
}

fn smoothed<const N: usize>(around: &Around<N>, sigma: [f64; N]) -> [f64; N] {
    let middle = around.iter().position(|(x, _)| *x == 0.0).expect("a place is near itself");
    let mut off = [0.0; N];
    let mut agreed = [(f64::NEG_INFINITY, f64::INFINITY); N];
    let mut open = [true; N];
    for half in WINDOWS {
        let window = &around[middle.saturating_sub(half)..(middle + half + 1).min(around.len())];
        let Some((is, spread)) = line_at_zero(window) else { continue };
        for i in 0..N {
            let margin = AGREE * sigma[i] * spread;
            let (low, high) = &mut agreed[i];
            (*low, *high) = (low.max(is[i] - margin), high.min(is[i] + margin));
            open[i] &= *low <= *high;
            if open[i] {
                off[i] = is[i];
            }
        }
        if window.len() == around.len() || open == [false; N] {
            break;
        }
    }
    std::array::from_fn(|i| if off[i].abs() > JUMP * sigma[i] { 0.0 } else { off[i] })
}

/// Least squares line through a window, evaluated at 0, and its standard deviation for poses that scatter by 1;
/// `None` for fewer than three poses.
fn line_at_zero<const N: usize>(window: &[(f64, [f64; N])]) -> Option<([f64; N], f64)> {
    let n = window.len() as f64;
    let mean = window.iter().map(|(x, _)| x).sum::<f64>() / n;
    let square = window.iter().map(|(x, _)| (x - mean).powi(2)).sum::<f64>();
    if window.len() < 3 || square <= 0.0 {
        return None;
    }
    let mut at_zero = [0.0; N];
    for (x, y) in window {
        let weight = 1.0 / n - mean * (x - mean) / square;
        (0..N).for_each(|i| at_zero[i] += weight * y[i]);
    }
    Some((at_zero, (1.0 / n + mean * mean / square).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stages::noise::Noise;

    /// Heights along a path, with added scatter.
    fn of(path: impl Fn(usize) -> f64, n: usize, sigma: f64, seed: u64) -> (Vec<f64>, Departures<1>) {
        let mut noise = Noise(seed);
        let is: Vec<f64> = (0..n).map(|k| path(k) + sigma * noise.normal()).collect();
        let found = departures(n, |k, reach| {
            let near = k.saturating_sub(reach)..(k + reach + 1).min(n);
            near.map(|j| (j as f64 - k as f64, [is[j] - is[k]])).collect()
        });
        let smooth = is.iter().zip(&found.off).map(|(y, off)| y + off[0]).collect();
        (smooth, found)
    }

    fn rms(smooth: &[f64], path: impl Fn(usize) -> f64) -> f64 {
        (smooth.iter().enumerate().map(|(k, y)| (y - path(k)).powi(2)).sum::<f64>() / smooth.len() as f64).sqrt()
    }

    #[test]
    fn scatter_about_a_straight_path_is_found_and_a_bent_path_stays_bent() {
        type Path = fn(usize) -> f64;
        let paths: [(&str, Path, f64); 5] = [
            ("straight", |k| 0.3 * k as f64, 0.25),
            ("a corner", |k| 0.5 * (k as f64 - 70.0).abs(), 0.6),
            ("a jump", |k| if k < 70 { 0.0 } else { 30.0 }, 0.6),
            ("slow waves", |k| 10.0 * (k as f64 / 12.0).sin(), 0.75),
            ("an arc", |k| 0.004 * (k as f64 - 60.0).powi(2), 0.5),
        ];
        for (name, path, left) in paths {
            let all: Vec<f64> = (0..20)
                .map(|seed| {
                    let (smooth, found) = of(path, 150, 1.0, seed);
                    assert!((0.7..1.4).contains(&found.sigma[0]), "{name}: {:?}", found.sigma);
                    rms(&smooth, path)
                })
                .collect();
            let mean = all.iter().sum::<f64>() / 20.0;
            assert!(mean < left, "{name}: {mean:.3} of {left} is left");
        }
    }

    #[test]
    fn few_places_and_places_without_scatter_stay_where_they_are() {
        for n in 0..4 {
            let (_, found) = of(|_| 0.0, n, 1.0, 1);
            assert_eq!(found.off.len(), n);
        }
        let (smooth, found) = of(|k| 0.25 * k as f64, 40, 0.0, 1);
        assert!(found.sigma[0] < 1e-12 && rms(&smooth, |k| 0.25 * k as f64) < 1e-12);
    }
}
