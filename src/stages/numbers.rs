//! In: the constants of the stages. Out: those that a shader also states, with their names there. Each is stated once
//! in Rust and once in WGSL, and tests/shader_contracts.rs compares them. Frame and unit: each number's own.

use super::frame::{ALL_TILES, GAUSSIAN, HAS_ROI};
use super::listing::{self, HEADER_WORDS};
use super::peak::across::{centre, direction, turn};
use super::peak::found::{REASON, Reject, SATURATED};
use super::peak::{fit, methods, scoring, windows};
use super::stripe::{optics, skeleton, spacing};
use super::{grid, support};

/// The shader that states it (empty: a shared text), its name there, its value in Rust.
pub const NUMBERS: &[(&str, &str, f64)] = &[
    ("", "GROUPS", listing::GROUPS as f64),
    ("", "GROUPS_Y", listing::GROUPS as f64 + 1.0),
    ("", "GROUPS_Z", listing::GROUPS as f64 + 2.0),
    ("", "COUNT", listing::COUNT as f64),
    ("", "FOUND", skeleton::FOUND as f64),
    ("", "LISTED", skeleton::LISTED as f64),
    ("", "LEFT", skeleton::LEFT as f64),
    ("", "SHOTS", skeleton::SHOTS as f64),
    ("", "STARTS", skeleton::HEADER as f64),
    ("", "HEADER_WORDS", HEADER_WORDS as f64),
    ("", "ALL_TILES", ALL_TILES as f64),
    ("", "HAS_ROI", HAS_ROI as f64),
    ("", "GAUSSIAN", GAUSSIAN as f64),
    ("", "REASON", REASON as f64),
    ("", "FAINT", Reject::Faint as u32 as f64),
    ("", "NARROW", Reject::Narrow as u32 as f64),
    ("", "WIDE", Reject::Wide as u32 as f64),
    ("", "UNCERTAIN", Reject::Uncertain as u32 as f64),
    ("", "STEEP", Reject::Steep as u32 as f64),
    ("", "ECHO", Reject::Echo as u32 as f64),
    ("", "UNSUPPORTED", Reject::Unsupported as u32 as f64),
    ("", "NO_POINT", Reject::NoPoint as u32 as f64),
    ("", "SATURATED", SATURATED as f64),
    ("", "RECORD", grid::RECORD as f64),
    ("", "BEYOND", grid::BEYOND as f64),
    ("", "Z_MOST", grid::Z_MOST as f64),
    ("peak", "BROAD", centre::BROAD as f64),
    ("peak", "BESIDE", fit::BESIDE as f64),
    ("peak", "BORDER_STEPS", direction::BORDER_STEPS as f64),
    ("peak", "LEAVES", direction::LEAVES as f64),
    ("peak", "DISUNITED", direction::DISUNITED as f64),
    ("peak", "STILL", windows::STILL as f64),
    ("peak", "BY_NOISE", fit::BY_NOISE as f64),
    ("peak", "UNEVEN", scoring::UNEVEN as f64),
    ("peak", "DARK", scoring::DARK as f64),
    ("peak", "LEAST", scoring::LEAST as f64),
    ("peak", "SOFT", scoring::SOFT as f64),
    ("peak", "EVEN", methods::EVEN as f64),
    ("peak", "ONE", turn::DIAGONAL as f64),
    ("peak", "TWO", turn::EVEN_ROW[1] as f64),
    ("peak", "FAR", turn::EVEN_ROW[0] as f64),
    ("peak", "NONE", turn::MIDDLE_ROW[1] as f64),
    ("point", "NEWTON", optics::NEWTON as f64),
    ("spacing", "FAR", spacing::FAR as f64),
    ("spacing", "NEAR", spacing::NEAR as f64),
    ("spacing", "COMPANY", spacing::COMPANY as f64),
    ("support", "FAR", support::stage::FAR as f64),
];
