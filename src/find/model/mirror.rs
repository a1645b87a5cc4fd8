//! In: a drawing. Out: whether the drawn part looks the same in a mirror, so that a scan of it cannot reveal mirrored
//! pictures.
//! Frame and unit: part frame, mm; shares of the drawn surfaces.

use super::drawing::Drawing;

/// Number of places along a side of the box that is compared, and the share of the surfaces that has to differ for a
/// scan to reveal mirrored pictures.
const SIDE: usize = 120;
const TOLD: f64 = 0.002;

/// True where less than two thousandths of the drawn surfaces lie elsewhere after mirroring along x or along y.
pub fn own_mirror_image(drawing: &Drawing) -> bool {
    let (faces, b) = (drawing.faces(), drawing.bounds());
    let middle = [(b[0] + b[2]) / 2.0, (b[1] + b[3]) / 2.0];
    let half = [(b[2] - b[0]) / 2.0, (b[3] - b[1]) / 2.0];
    let at = |i: usize, axis: usize| half[axis] * ((2 * i + 1) as f64 / SIDE as f64 - 1.0);
    let share = |mirror: [f64; 2]| {
        let (mut differ, mut all) = (0usize, 0usize);
        for (i, j) in (0..SIDE * SIDE).map(|k| (k / SIDE, k % SIDE)) {
            let (x, y) = (at(i, 0), at(j, 1));
            for f in &faces {
                let here = f.material(middle[0] + x, middle[1] + y);
                let there = f.material(middle[0] + mirror[0] * x, middle[1] + mirror[1] * y);
                all += usize::from(here);
                differ += usize::from(here != there);
            }
        }
        differ as f64 / (2 * all).max(1) as f64
    };
    share([1.0, -1.0]).min(share([-1.0, 1.0])) < TOLD
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::find::Recipe;

    #[test]
    fn a_notched_socket_is_its_own_mirror_image_and_a_cut_corner_is_not() {
        let led = Recipe::parse(include_str!("../../../data/recipes/led.toml")).unwrap();
        assert!(own_mirror_image(&led.drawing()));
        let osc = Recipe::parse(include_str!("../../../data/recipes/osc.toml")).unwrap();
        assert!(!own_mirror_image(&osc.drawing()));
    }
}
