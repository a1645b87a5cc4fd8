//! Names the pictures that come from another camera than the others.

use super::chance::{ln_sets, ln_tail};
use super::change::{FREE, Kind};
use super::pictures::Set;
use super::search::{Linear, beforehand};
use super::two::{Two, free_rows};
use crate::calibrate::camera::intrinsics::{Observation, SolveOptions, Solved};
use crate::camera::Flip;
use crate::fault::Fault;

/// Smallest set in which some pictures can be distinguished from the rest.
const FEWEST: usize = 5;
/// Largest probability that chance accuses a correct set.
const BY_CHANCE: f64 = 1e-4;
/// Number of kinds that are tried: three with parameters, three flips.
const KINDS: f64 = 6.0;
/// A change or a flip is only solved for if its preliminary estimate reaches this share of the required
/// log-probability.
const WORTH_A_LOOK: f64 = 0.5;
/// Largest typical residual of the second part with its own camera, as a multiple of the first part's. Pictures that
/// fit neither camera are not pictures of another one.
const EXPLAINED: f64 = 2.0;
/// Smallest ratio of the second part's typical residual with the first camera to that with its own. Errors of lens
/// model and print favour another camera too. For 5 of 13 photographs of one real camera, a focal length 0.7 % longer
/// gave 0.03 px instead of 0.05 (1.7 times). Photographs of two cameras gave 3.4 times.
const CLEARLY: f64 = 2.5;

/// Smallest such residual with the first camera in a set of fewer pictures than [`SETTLED`], px. Two or three pictures
/// with numbers of their own follow the errors of lens model and print closely. Of 144 small sets of photographs of one
/// camera each, 5 were accused with 0.09 to 0.2 px.
const SMALL_SET_PX: f64 = 0.25;
/// Number of pictures from which on the scatter between these is known well enough to judge by that alone.
const SETTLED: usize = 8;

/// From the share 1 / HALF on, the smaller part may be the right one. Of 100 simulated sets in which a tenth to a half
/// of the pictures were changed, 2 accused the right 45 and 47 % of theirs.
const HALF: f64 = 2.5;

/// Pictures that another camera took, or that were read out differently.
#[derive(Clone, Debug, PartialEq)]
pub struct Apart {
    /// Indices of the pictures.
    pub which: Vec<usize>,
    /// The difference in words, such as "turned by 180 degrees".
    pub how: String,
    /// Typical residuals of these pictures without and with that change, px.
    pub misfit_px: [f64; 2],
    cause: &'static str,
}

impl Apart {
    /// Reason for excluding a single picture.
    pub fn reason(&self) -> String {
        let [is, then] = self.misfit_px;
        format!(
            "it fits the other pictures' camera to {is:.2} px, and to {then:.2} px if it is {}; {}",
            self.how, self.cause
        )
    }

    /// Fault of a set that cannot be used.
    pub fn fault(&self, pictures: &[Observation]) -> Fault {
        const MOST: usize = 12;
        let (count, all) = (self.which.len(), pictures.len());
        let named: Vec<&str> = self.which.iter().take(MOST).map(|&i| pictures[i].name.as_str()).collect();
        let more = if count > MOST { format!(" and {} more", count - MOST) } else { String::new() };
        let half = if HALF * count as f64 >= all as f64 { "; or the others were, and these are right" } else { "" };
        let [is, then] = self.misfit_px;
        Fault::input(format!(
            "{count} of {all} pictures do not fit the other pictures' camera: the misfit is {is:.2} px, and \
             {then:.2} px if they are {}: {}{more}{half}",
            self.how,
            named.join(", ")
        ))
        .cause(self.cause)
        .next("exclude these pictures or turn them back, then calibrate again")
    }
}

/// The pictures that differ from the others; `None` for a set of one camera with one readout.
pub fn apart(pictures: &[Observation], solved: &Solved, options: &SolveOptions) -> Option<Apart> {
    if pictures.len() < FEWEST {
        return None;
    }
    let (set, from) = Set::new(pictures, solved, options);
    let all: Vec<usize> = (0..set.len()).collect();
    let one = Two::solved(&set, &from, Kind::Same, vec![false; set.len()])?;
    let variance = one.scales()[0].powi(2);
    let told = set.look(&all, &one.stand.camera, &one.stand.shape, &one.stand.poses)?.told;
    let prior = beforehand(&set, variance);
    let mut best: Option<Tried> = None;
    for kind in FREE {
        let linear = Linear::new(&told, &prior, &free_rows(&set, &kind.directions(&set.like)))?;
        let other = linear.best(variance);
        let likely = -0.5 * linear.gain(&other) / variance;
        if likely > WORTH_A_LOOK * limit(&other) {
            continue;
        }
        let Some(two) = Two::solved(&set, &one.stand, kind, other) else { continue };
        let mut tried = vec![judged(&set, &one, &two)];
        // A flip moves the principal point, so a free change of the principal point already looks likely.
        if kind != Kind::Focus && tried[0].as_ref().is_some_and(|t| t.chance < WORTH_A_LOOK * limit(&two.other)) {
            let flips = Flip::ALL
                .into_iter()
                .filter_map(|flip| Two::solved(&set, &one.stand, Kind::Flip(flip), two.other.clone()));
            tried.extend(flips.map(|two| judged(&set, &one, &two)));
        }
        best = tried.into_iter().flatten().filter(|t| t.sure).chain(best).max_by(|a, b| a.worth.total_cmp(&b.worth));
    }
    best.map(|b| b.apart)
}

/// Logarithm of the probability below which a split of the set is accepted.
fn limit(other: &[bool]) -> f64 {
    BY_CHANCE.ln() - KINDS.ln() - ln_sets(other)
}

struct Tried {
    /// Logarithm of the probability that chance explains the gain.
    chance: f64,
    sure: bool,
    /// Half of the gain minus half of the parameters' number times the logarithm of the number of coordinates.
    worth: f64,
    apart: Apart,
}

fn judged(set: &Set, one: &Two, two: &Two) -> Option<Tried> {
    let kind = two.kind;
    let [scale, second] = two.scales();
    let numbers = kind.directions(&set.like).ncols();
    let (scatter, freedom) = two.scatter(set)?;
    let gain = (one.cost(set, scale) - two.cost(set, scale)) / scatter;
    let chance = ln_tail(gain, numbers.max(2), freedom);
    let which: Vec<usize> = (0..set.len()).filter(|&i| two.other[i]).collect();
    let alone = set.look(&which, &two.stand.camera, &two.stand.shape, &two.stand.poses);
    let alone = alone.map_or(f64::INFINITY, |l| l.scale());
    let px = set.sigma_px(&which);
    let large = set.len() >= SETTLED || alone * px > SMALL_SET_PX;
    let explained = second < EXPLAINED * scale && alone > CLEARLY * second && large;
    Some(Tried {
        chance,
        sure: chance < limit(&two.other) && kind.is_visible(&two.change) && explained,
        worth: 0.5 * gain - 0.5 * numbers as f64 * (set.coordinates() as f64).ln(),
        apart: Apart { misfit_px: [alone * px, second * px], how: kind.words(&two.change), cause: kind.cause(), which },
    })
}
