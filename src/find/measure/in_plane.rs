//! In: ends of surfaces beside their drawn edges. Out: the part's place and turn in its plane, with covariance
//! (docs/math.md, Insertion (3) and (4)).
//! Frame and unit: a correction in the part frame: x y mm, turn about z rad.

use super::options::MeasureOptions;
use super::robust::robust;
use super::surface_ends::Observation;
use crate::fault::{Fault, Result};
use nalgebra::{Matrix3, SVector, Vector3};
use std::collections::BTreeMap;

/// Fewer ends do not determine a position.
const MIN_EDGES: usize = 40;
/// Standard deviation of an edge's position between two shots, as a share of the step. The light of partly lit samples
/// reduces it to about half of that of a uniform phase (0.29).
const PHASE: f64 = 0.15;
/// Prior standard deviation of the growth of surfaces, in the recipe's unit of about 1 mm: half a laser line.
const GROWTH_PRIOR: f64 = 0.05;

pub(in crate::find) struct InPlane {
    pub step: Vector3<f64>,
    pub growth: [f64; 2],
    pub covariance: Matrix3<f64>,
    pub used: usize,
    pub sigma: f64,
    pub observations: Vec<Observation>,
}

pub(in crate::find) fn fit_edges(
    mut observations: Vec<Observation>,
    step: &[f64; 2],
    options: &MeasureOptions,
) -> Result<InPlane> {
    let axes = [0, 1].map(|a| observations.iter().filter(|o| o.locates && o.axis == a).count());
    let locating = axes[0] + axes[1];
    if locating < MIN_EDGES {
        return Err(Fault::refused(format!(
            "{} ends of surfaces lie within edge_gate_mm = {} of the drawn edges ({} along the stripe, {} from shot \
             to shot), at least {MIN_EDGES} are needed",
            locating, options.edge_gate_mm, axes[0], axes[1]
        ))
        .cause("the part is hidden, is another one, or the search was misled")
        .next("look at the picture of the match, then scan the part again"));
    }
    let rows: Vec<_> = observations.iter().filter(|o| o.locates).map(row).collect();
    let growth = GROWTH_PRIOR * options.unit();
    let fit = robust(&rows, &[(3, growth), (4, growth)], 0.03 * options.unit()).ok_or_else(|| {
        Fault::refused("the seen edges do not determine the part's place and turn")
            .cause("only edges of one direction are seen")
            .next("scan more of the part")
    })?;
    for (o, w) in observations.iter_mut().filter(|o| o.locates).zip(&fit.weights) {
        o.weight = *w;
    }
    let mut covariance: Matrix3<f64> = fit.covariance.fixed_view::<3, 3>(0, 0).into();
    if let Some(whole_shots) = of_whole_shots(&observations, PHASE * step[1]) {
        covariance += whole_shots;
    }
    // An error that all edges of a kind share shifts the part as a whole.
    let bias = options.edge_bias * step[0].max(step[1]);
    covariance[(0, 0)] += bias * bias;
    covariance[(1, 1)] += bias * bias;
    let far = observations.iter().filter(|o| o.locates).map(|o| o.x * o.x + o.y * o.y);
    let span = far.sum::<f64>() / locating as f64;
    covariance[(2, 2)] += bias * bias / span.max(options.unit().powi(2));
    Ok(InPlane {
        step: fit.step.fixed_rows::<3>(0).into(),
        growth: [fit.step[3], fit.step[4]],
        covariance,
        used: fit.used,
        sigma: fit.sigma,
        observations,
    })
}

/// Derivative of a residual by place, turn and the growth along its axis; the residual; its shot.
fn row(o: &Observation) -> (SVector<f64, 5>, f64, u32) {
    let mut j = SVector::<f64, 5>::zeros();
    j[0] = o.nx;
    j[1] = o.ny;
    j[2] = o.x * o.ny - o.y * o.nx;
    j[3 + o.axis] = 1.0;
    (j, o.residual, o.row)
}

/// What is added to the covariance because a shot's position relative to an edge is known only to `phase`, mm.
fn of_whole_shots(observations: &[Observation], phase: f64) -> Option<Matrix3<f64>> {
    // From shot to shot, an edge along the stripe is seen by only one or two shots. All its samples share the position
    // of those shots relative to it: one measurement each, however many columns. The order is fixed, so that the same
    // scan gives the same sums to the last bit.
    let mut shared: BTreeMap<(u32, bool), Vector3<f64>> = BTreeMap::new();
    let mut normal = Matrix3::zeros();
    for o in observations.iter().filter(|o| o.locates && o.weight > 0.0) {
        let j = Vector3::new(o.nx, o.ny, o.x * o.ny - o.y * o.nx) * o.weight;
        normal += j * j.transpose() / o.weight;
        if o.axis == 1 {
            let ascending = if o.nx.abs() > o.ny.abs() { o.nx > 0.0 } else { o.ny > 0.0 };
            *shared.entry((o.row, ascending)).or_insert_with(Vector3::zeros) += j;
        }
    }
    let inverse = normal.try_inverse()?;
    let middle = shared.values().map(|j| j * j.transpose()).sum::<Matrix3<f64>>() * (phase * phase);
    Some(inverse * middle * inverse)
}
