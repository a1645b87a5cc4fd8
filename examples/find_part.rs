//! A finished scan and a recipe in; where the tool goes, how sure that is, or why there is no pose.
//!
//!   cargo run --example find_part -- SCAN RECIPE STATION

use sheetlight::fault::{Fault, Result};
use sheetlight::find::{LocateOptions, Recipe};
use sheetlight::station::find_part;
use std::path::PathBuf;

fn main() -> Result<()> {
    let paths: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [scan, recipe, station] = paths.as_slice() else {
        return Err(Fault::usage("a scan, a recipe and a station are needed").next("give SCAN RECIPE STATION"));
    };
    let recipe = Recipe::load(recipe)?;
    let (report, picture) = find_part(scan, &recipe, Some(station), &LocateOptions::default())?;
    match &report.poses {
        Some(poses) => println!("insertion {:?} ({})", poses.insertion.numbers, poses.insertion.convention),
        None => println!("no pose: {}", report.reasons.join("; ")),
    }
    println!("sigma {:.4?} mm, {:.4?} degrees along the part's axes", report.sigma_mm, report.sigma_deg);
    picture.save_png(&scan.join("found.png"))
}
