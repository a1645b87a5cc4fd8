//! In: a cloud on disk. Out: a uniformly spread subset of its points, small enough to send and to display.
//! Frame and unit: the cloud's frame, mm, relative to the stated origin.

use sheetlight::fault::Result;
use sheetlight::scan::{CloudPoint, PointSource};

/// Points to display.
pub struct CloudView {
    /// Number of points in the whole cloud.
    pub all: u64,
    /// Origin of the coordinates, mm.
    pub origin: [f64; 3],
    /// x, y, z, sigma_mm and intensity of each point.
    pub points: Vec<[f32; 5]>,
}

/// Takes at most `most` of the points that `stays` accepts. They are reordered by a golden-section step, so that
/// any leading fraction covers the whole scan. A page that shows the first tenth shows the whole part, coarsely.
pub fn view(cloud: &impl PointSource, all: u64, most: usize, stays: &dyn Fn(&glam::Vec3) -> bool) -> Result<CloudView> {
    let every = all.div_ceil(most.max(1) as u64).max(1);
    let mut taken: Vec<CloudPoint> = Vec::with_capacity((all / every) as usize + 1);
    let mut index = 0u64;
    cloud.for_each_chunk(&mut |chunk| {
        for p in chunk {
            if index.is_multiple_of(every) && stays(&p.position) {
                taken.push(*p);
            }
            index += 1;
        }
    })?;
    let n = taken.len().max(1) as f64;
    let origin = [0, 1, 2].map(|k| taken.iter().map(|p| f64::from(p.position[k])).sum::<f64>() / n);
    let step = coprime(taken.len());
    let at = |i: usize| {
        let p = &taken[(i * step) % taken.len()];
        let [x, y, z] = [0, 1, 2].map(|k| (f64::from(p.position[k]) - origin[k]) as f32);
        [x, y, z, p.sigma_mm, p.intensity]
    };
    Ok(CloudView { all, origin, points: (0..taken.len()).map(at).collect() })
}

/// A step near the golden section of `n` that visits every index once.
fn coprime(n: usize) -> usize {
    let gcd = |mut a: usize, mut b: usize| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let golden = (n as f64 * 0.618_034) as usize;
    (golden.max(1)..).find(|s| gcd(*s, n) == 1 || n < 2).unwrap_or(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_share_of_a_view_covers_the_scan() {
        let cloud: Vec<CloudPoint> = (0..10_000)
            .map(|i| CloudPoint { position: [i as f32, 0.0, 5.0].into(), ..CloudPoint::default() })
            .collect();
        let view = view(&cloud, 10_000, 1000, &|_| true).unwrap();
        assert_eq!((view.all, view.points.len()), (10_000, 1000));
        let mut seen: Vec<f32> = view.points.iter().map(|p| p[0]).collect();
        let mut first: Vec<f32> = seen[..50].to_vec();
        first.sort_by(f32::total_cmp);
        let gap = first.windows(2).map(|w| w[1] - w[0]).fold(0.0, f32::max);
        assert!(gap < 500.0, "a hole of {gap} of 10000 in the first twentieth");
        seen.sort_by(f32::total_cmp);
        seen.dedup();
        assert_eq!(seen.len(), 1000, "each point once");
        assert!(super::view(&Vec::<CloudPoint>::new(), 0, 10, &|_| true).unwrap().points.is_empty());
    }
}
