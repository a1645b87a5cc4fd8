//! In: nothing. Out: every stage with its twin, its cases and how far the two may be apart.
//! Frame and unit: each stage's own.

use super::entry::{Entry, differing_words, differing_words_beside_order};
use super::shape::{self, maps, sums};
use super::stripe::{ambient, choose, hough, lengthen, point, skeleton, specks, stats, thin, threshold, tiles};
use super::{cases, grid, listing, peak, support};

const EXACT: &str = "whole numbers only: every word is the same";
const UNORDERED: &str = "whole numbers only: the same set, in whatever order the GPU ran";

/// Every stage, in the order of the chain; tests and the self-test of `sheetlight doctor` run over it.
pub fn all() -> Vec<Entry> {
    let exact = |stage, twin, cases| Entry { stage, twin, cases, compare: differing_words, limit: 0.0, reason: EXACT };
    let unordered = |stage, twin, cases| Entry {
        compare: |gpu, twin| differing_words_beside_order(gpu, twin, &[(gpu.len() - 1, 1)]),
        reason: UNORDERED,
        ..exact(stage, twin, cases)
    };
    vec![
        exact(&listing::CLEAR, listing::clear_twin, || cases::of("clear")),
        exact(&listing::RESET, listing::reset_twin, || cases::of("reset")),
        exact(&ambient::STAGE, ambient::twin, || cases::of("ambient")),
        exact(&stats::STAGE, stats::twin, || cases::of("stats")),
        Entry {
            compare: |gpu, twin| differing_words_beside_order(gpu, twin, &[(5, 2), (7, 2)]),
            reason: UNORDERED,
            ..exact(&tiles::STAGE, tiles::twin, || cases::of("tiles"))
        },
        Entry {
            compare: |gpu, twin| differing_words_beside_order(gpu, twin, &[(8, 1), (10, 2)]),
            reason: UNORDERED,
            ..exact(&specks::STAGE, specks::twin, || cases::of("specks"))
        },
        unordered(&threshold::MEAN, threshold::mean_twin, || cases::of("threshold")),
        Entry {
            compare: threshold::pixels_apart,
            limit: 1.0,
            reason: "f32 sums in another order; at most 1 pixel in 100,000 lies that near to its limit",
            ..exact(&threshold::GAUSSIAN, threshold::stage_twin, || cases::of("threshold_gaussian"))
        },
        unordered(&threshold::GATHER, threshold::gather_twin, || cases::of("gather")),
        exact(&thin::STAGE, thin::stage_twin, || cases::of("thin")),
        unordered(&listing::COMPACT, listing::compact_twin, || cases::of("compact")),
        exact(&listing::REBASE, listing::rebase_twin, || cases::of("rebase")),
        exact(&skeleton::COUNT, skeleton::count_twin, || cases::of("count")),
        exact(&skeleton::SCAN_ROWS, skeleton::scan_rows_twin, || cases::of("scan_rows")),
        exact(&skeleton::SCAN_SHOTS, skeleton::scan_shots_twin, || cases::of("scan_shots")),
        exact(&skeleton::HEAD, skeleton::head_twin, || cases::of("header")),
        exact(&hough::STAGE, hough::stage_twin, cases::hough),
        exact(&skeleton::STAGE, skeleton::stage_twin, || cases::of("skeleton")),
        exact(&lengthen::COPY, lengthen::copy_twin, || cases::of("skeleton_copy")),
        exact(&lengthen::STAGE, lengthen::stage_twin, || cases::of("lengthen")),
        Entry {
            compare: peak::apart,
            limit: 1.0,
            reason: "exp differs by some ulps, and a fit may stop one step earlier: position 0.01 px or 0.01 sigma, width 1 %",
            ..exact(&peak::STAGE, peak::stage_twin, || cases::peaks("peak"))
        },
        exact(&choose::LINES, choose::lines_twin, || cases::peaks("lines")),
        Entry {
            compare: point::apart,
            limit: 1.0,
            reason: "f32 with or without fused multiply-add: 1 um, stated sigma 1 %",
            ..exact(&point::STAGE, point::stage_twin, || cases::peaks("point"))
        },
        exact(&support::STAGE, support::stage_twin, support::cases),
        exact(&grid::SPAN, grid::span_twin, || grid::cases("grid_span")),
        exact(&grid::SUM, grid::sum_twin, || grid::cases("grid_sum")),
        exact(&grid::PICK, grid::pick_twin, || grid::cases("grid_pick")),
        exact(&maps::QUANTISE, maps::quantise_twin, || shape::cases::cases("shape_quantise")),
        exact(&maps::SPREAD, maps::spread_twin, || shape::cases::cases("shape_spread")),
        exact(&sums::SCORE, sums::score_twin, || shape::cases::cases("shape_score")),
        Entry {
            compare: sums::differing_hits,
            reason: UNORDERED,
            ..exact(&sums::PEAKS, sums::peaks_twin, || shape::cases::cases("shape_peaks"))
        },
    ]
}
