//! In: a scene, a taught template, search options, and down to which score the values may decide. Out: matches with the
//! correlation of their values.
//! Frame and unit: pixels of the scene, as in `full`.

use super::accelerator::Accelerator;
use super::area::Area;
use super::full::{Match, find_in, find_where, overlap};
use super::options::SearchOptions;
use super::refine::Pose;
use super::witness::Witness;
use crate::fault::{Fault, Result};
use crate::find::model::template::Template;
use crate::find::scene::{Kind, Scene};

/// Which matches below the least score are accepted because the template's grey levels agree too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weak {
    /// Least score of such a match, 0.1 to 1; none are searched where it is not below the search's own least score.
    pub min_score: f64,
    /// Least correlation of such a match, above 0 to 1. Where polarity is ignored, as much below 0 counts too.
    pub min_correlation: f64,
}

impl Default for Weak {
    /// The limits of docs/match.md, which were measured there.
    fn default() -> Self {
        Weak { min_score: 0.4, min_correlation: 0.8 }
    }
}

impl Weak {
    fn check(&self) -> Result<()> {
        for (name, value) in [("weak score", self.min_score), ("weak correlation", self.min_correlation)] {
            if !(0.1..=1.0).contains(&value) {
                return Err(Fault::usage(format!("the {name} is {value}; allowed: 0.1 to 1"))
                    .next("correct the search options"));
            }
        }
        Ok(())
    }
}

/// Finds a template in a scene. What reaches the least score comes as from [`find_in`]. Room for more is filled with
/// matches down to `weak`'s score whose grey levels correlate; they overlap no other match. Heights are only compared.
///
/// # Errors
/// Those of [`find_in`]; limits of `weak` out of range.
pub fn find_taught(
    scene: &Scene,
    template: &Template,
    options: &SearchOptions,
    weak: Option<&Weak>,
    area: Option<&Area>,
    accelerator: Option<&Accelerator>,
) -> Result<Vec<Match>> {
    let mut found = find_in(scene, &template.model, options, area, accelerator)?;
    let Some(witness) = witness(scene, template, options.scales) else { return Ok(found) };
    let weak = weak.map(|w| w.check().map(|()| w)).transpose()?.filter(|w| w.min_score < options.min_score);
    // Heights do not decide: on a real plate a ball correlates by 0.93 with a cap of another size.
    let weak = weak.filter(|_| template.mm_per_px.is_none() && found.len() < options.max_matches);
    if let Some(weak) = weak {
        let agrees = |pose: &Pose| {
            let value = |c: f64| if options.ignore_polarity { c.abs() } else { c };
            found.iter().all(|m| overlap(&template.model, &m.pose, pose) <= options.max_overlap)
                && witness.correlation(pose).is_some_and(|c| value(c) >= weak.min_correlation)
        };
        let more = SearchOptions { min_score: weak.min_score, ..options.at_most(SearchOptions::MOST_MATCHES) };
        let more = SearchOptions { max_matches: options.max_matches - found.len(), ..more };
        let also = find_where(scene, &template.model, &more, area, &agrees, accelerator)?;
        found.extend(also);
        found.sort_by(|a, b| b.score.total_cmp(&a.score));
    }
    found.iter_mut().for_each(|m| m.correlation = witness.correlation(&m.pose));
    Ok(found)
}

/// What compares the template's values; `None` for a file of before they were stored.
pub(super) fn witness<'a>(scene: &'a Scene, template: &Template, scales: [f64; 2]) -> Option<Witness<'a>> {
    let kind = if template.mm_per_px.is_some() { Kind::Height } else { Kind::Intensity };
    let [_, _, w, h] = template.region_px;
    Witness::new(template.levels.as_ref()?, [w, h], kind, scene, scales)
}
