//! In: the chain's table, the stages beside it. Out: every stage with its twin, its cases and the allowed difference.
//! Frame and unit: each stage's own.

use super::chain::table::steps;
use super::entry::{Case, Entry};
use super::same::Same;
use super::shape::{self, maps, sums};
use super::step::{Step, Twin};
use super::stripe::{choose, hough, point};
use super::{cases, grid, peak, support};
use crate::gpu::Stage;

/// Every stage; tests and the self-test of `sheetlight doctor` run all of them.
pub fn all() -> Vec<Entry> {
    let of_chain = |s: &Step| Entry {
        stage: s.stage,
        twin: s.twin,
        cases: Box::new({
            let name = s.stage.name;
            move || cases::of(name)
        }),
        same: s.same,
    };
    let own = |stage: &'static Stage, twin: Twin, cases: fn() -> Vec<Case>, same: Same| Entry {
        stage,
        twin,
        cases: Box::new(cases),
        same,
    };
    let words = |stage, twin, cases| own(stage, twin, cases, Same::Words);
    let beside = vec![
        words(&hough::STAGE, hough::stage_twin, cases::hough),
        own(
            &peak::STAGE,
            peak::stage_twin,
            || cases::peaks("peak"),
            Same::Within(
                peak::apart,
                1.0,
                "exp differs by some ulps, and a fit may stop one step earlier: position 0.01 px or 0.01 sigma, \
                 width 1 %",
            ),
        ),
        words(&choose::LINES, choose::lines_twin, || cases::peaks("lines")),
        own(
            &point::STAGE,
            point::stage_twin,
            || cases::peaks("point"),
            Same::Within(point::apart, 1.0, "f32 with or without fused multiply-add: 1 um, stated sigma 1 %"),
        ),
        words(&support::STAGE, support::stage_twin, support::cases),
        words(&grid::SPAN, grid::span_twin, || grid::cases("grid_span")),
        words(&grid::SUM, grid::sum_twin, || grid::cases("grid_sum")),
        words(&grid::PICK, grid::pick_twin, || grid::cases("grid_pick")),
        words(&maps::QUANTISE, maps::quantise_twin, || shape::cases::cases("shape_quantise")),
        words(&maps::SPREAD, maps::spread_twin, || shape::cases::cases("shape_spread")),
        words(&sums::SCORE, sums::score_twin, || shape::cases::cases("shape_score")),
        own(
            &sums::PEAKS,
            sums::peaks_twin,
            || shape::cases::cases("shape_peaks"),
            Same::Within(sums::differing_hits, 0.0, "whole numbers only: the same set, in whatever order the GPU ran"),
        ),
    ];
    steps().map(of_chain).chain(beside).collect()
}
