//! In: the peaks of one shot. Out: the kept ones in their order along the stripe, and who is whose neighbour there.
//! Frame and unit: pixels of the shot, along the stripe and across it.

use crate::stages::peak::found::Peak;
use glam::Vec2;

/// Distance over which a fit mixes light, in the stripe's sigmas.
const NEAR: f32 = 3.5;
/// Least such distance, px: thinning leaves gaps of a pixel.
const NEAR_PX: f32 = 2.5;

/// Distance up to which points of a line are neighbours, px; `width_px` is the stripe's Gaussian sigma.
pub(super) fn near_px(width_px: f32) -> f32 {
    (NEAR * width_px).max(NEAR_PX)
}

/// A kept peak.
#[derive(Clone, Copy)]
struct Site {
    /// Position along the stripe and across it, px.
    at: Vec2,
    /// Its index.
    peak: usize,
}

/// The kept peaks of a shot.
pub(super) struct Line {
    sites: Vec<Site>,
}

impl Line {
    /// `across` is the unit vector across the stripe.
    pub fn new(peaks: &[Peak], across: Vec2) -> Line {
        let along = across.perp();
        let site = |(peak, k): (usize, &Peak)| {
            let at = Vec2::new(k.u, k.v);
            Site { at: Vec2::new(at.dot(along), at.dot(across)), peak }
        };
        let mut sites: Vec<Site> = peaks.iter().enumerate().filter(|(_, k)| k.kept()).map(site).collect();
        sites.sort_by(|a, b| a.at.x.total_cmp(&b.at.x));
        Line { sites }
    }

    /// Number of kept peaks.
    pub fn len(&self) -> usize {
        self.sites.len()
    }

    /// Index of the `i`-th one among all peaks.
    pub fn peak(&self, i: usize) -> usize {
        self.sites[i].peak
    }

    /// How far the `j`-th one lies from the `i`-th along the stripe, px.
    pub fn way(&self, i: usize, j: usize) -> f32 {
        self.sites[j].at.x - self.sites[i].at.x
    }

    /// How far the `j`-th one lies from the `i`-th across the stripe, px.
    pub fn off(&self, i: usize, j: usize) -> f32 {
        self.sites[j].at.y - self.sites[i].at.y
    }

    /// Those up to this distance along the stripe from the `i`-th one, on the side where the order goes on by `step`.
    pub fn along(&self, i: usize, step: isize, reach: f32) -> impl Iterator<Item = usize> + '_ {
        std::iter::successors(i.checked_add_signed(step), move |j| j.checked_add_signed(step))
            .take_while(move |&j| j < self.len() && self.way(i, j).abs() <= reach)
    }

    /// Neighbours of the `i`-th one up to this distance, on that side.
    pub fn beside(&self, i: usize, step: isize, near: f32) -> impl Iterator<Item = usize> + '_ {
        self.along(i, step, near).filter(move |&j| self.sites[j].at.distance(self.sites[i].at) <= near)
    }
}
