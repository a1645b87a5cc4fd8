//! In: where in a scene parts may lie, as corners of a polygon. Out: the cells that a search there needs, and whether a
//! match lies in it.
//! Frame and unit: pixels of the scene, an integer is a pixel's centre.

use super::options::SearchOptions;
use super::refine::Pose;
use crate::fault::{Fault, Result};
use crate::find::model::shape_model::ShapeModel;
use crate::find::scene::{Region, Scene};

/// Where the middle of a match must lie: a polygon that does not cross itself.
#[derive(Clone, Debug, PartialEq)]
pub struct Area {
    corners: Vec<[f64; 2]>,
}

/// Most corners of a polygon that a user draws.
const MOST_CORNERS: usize = 1000;
/// Border around a match's edges that the search reads, px: slopes, spreading, refinement.
const BORDER_PX: f64 = 16.0;
/// The crop starts at a multiple of this, so that its pyramid has the same cells as the whole scene's.
const ALIGNED: usize = 256;

impl Area {
    /// An area with three corners or more, finite, not all on a line.
    ///
    /// # Errors
    /// Any other corners.
    pub fn polygon(corners: Vec<[f64; 2]>) -> Result<Area> {
        let bad = |what: String| {
            Fault::usage(what)
                .cause("a corner is missing or slipped")
                .next("give three corners or more, x,y each, in px")
        };
        if !(3..=MOST_CORNERS).contains(&corners.len()) {
            return Err(bad(format!("the polygon has {} corners; allowed: 3 to {MOST_CORNERS}", corners.len())));
        }
        if corners.iter().flatten().any(|v| !(v.abs() <= 1e6)) {
            return Err(bad("a corner of the polygon is farther than 1000000 px away".into()));
        }
        let around = corners.iter().zip(corners.iter().cycle().skip(1));
        let twice: f64 = around.map(|(a, b)| a[0] * b[1] - b[0] * a[1]).sum();
        if twice.abs() < 2.0 {
            return Err(bad(format!("the polygon holds {:.2} px; allowed: 1 or more", 0.5 * twice.abs())));
        }
        Ok(Area { corners })
    }

    /// The rectangle whose top left pixel is (x, y), `width` by `height` pixels.
    ///
    /// # Errors
    /// Sizes that are not above 0.
    pub fn rectangle([x, y, width, height]: [f64; 4]) -> Result<Area> {
        if !(width > 0.0 && height > 0.0) {
            return Err(Fault::usage(format!("the region is {width} by {height} px; allowed: above 0"))
                .cause("two corners instead of a corner and a size")
                .next("give x,y,width,height in px"));
        }
        let (x0, y0) = (x - 0.5, y - 0.5);
        Area::polygon(vec![[x0, y0], [x0 + width, y0], [x0 + width, y0 + height], [x0, y0 + height]])
    }

    /// Whether a place lies inside, by the number of times that a line to its right crosses the border.
    pub fn contains(&self, [x, y]: [f64; 2]) -> bool {
        let around = self.corners.iter().zip(self.corners.iter().cycle().skip(1));
        let crossed =
            around.filter(|(a, b)| (a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]));
        crossed.count() % 2 == 1
    }

    /// Whether the middle of the model's box lies inside.
    pub(super) fn holds(&self, model: &ShapeModel, pose: &Pose) -> bool {
        let (x, y) = pose.point(model.centre[0], model.centre[1]);
        self.contains([x, y])
    }

    /// The cells that a match with its middle in this area can touch.
    ///
    /// # Errors
    /// An area outside the scene.
    pub(super) fn cells(&self, scene: &Scene, model: &ShapeModel, options: &SearchOptions) -> Result<Region> {
        let reach = options.scales[1] * model.half_size[0].hypot(model.half_size[1]) + BORDER_PX;
        let along = |k: usize, size: usize| {
            let of = self.corners.iter().map(|c| c[k]);
            let (low, high) = (of.clone().fold(f64::MAX, f64::min), of.fold(f64::MIN, f64::max));
            if high < 0.0 || low > size as f64 - 1.0 {
                return None;
            }
            let first = (low - reach).max(0.0) as usize;
            Some((first / ALIGNED * ALIGNED, ((high + reach).max(0.0) as usize + 2).min(size)))
        };
        let (Some((x0, x1)), Some((y0, y1))) = (along(0, scene.width()), along(1, scene.height())) else {
            return Err(Fault::usage(format!(
                "the search region is outside the picture of {}x{} px",
                scene.width(),
                scene.height()
            ))
            .cause("numbers of another picture")
            .next("give the region in px of this picture, x to the right, y down"));
        };
        Ok(Region { x0, y0, x1, y1 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polygon_holds_what_is_inside() {
        let hook =
            Area::polygon(vec![[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [6.0, 10.0], [6.0, 4.0], [0.0, 4.0]]).unwrap();
        assert!(hook.contains([2.0, 2.0]) && hook.contains([8.0, 9.0]) && !hook.contains([2.0, 8.0]));
        let one = Area::rectangle([3.0, 4.0, 1.0, 1.0]).unwrap();
        assert!(one.contains([3.0, 4.0]) && !one.contains([4.0, 4.0]) && !one.contains([3.0, 3.0]));
        assert!(Area::rectangle([3.0, 4.0, 0.0, 1.0]).is_err());
        assert!(Area::polygon(vec![[0.0, 0.0], [1.0, 1.0], [5.0, 5.0]]).is_err());
        assert!(Area::polygon(vec![[0.0, 0.0], [f64::NAN, 1.0], [5.0, 0.0]]).is_err());
    }
}
