//! One picture of the stripe and a station in; the stripe's points out, as CSV: pixel, point, standard deviation. No
//! robot: the points are in the camera's frame, mm.
//!
//!   cargo run --example picture_to_points -- PICTURE STATION

use sheetlight::Scan;
use sheetlight::fault::{Fault, Result};
use sheetlight::raster::{Channel, load};
use std::path::PathBuf;

fn main() -> Result<()> {
    let paths: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [picture, station] = paths.as_slice() else {
        return Err(Fault::usage("a picture and a station are needed").next("give PICTURE STATION"));
    };
    let shot = Scan::at(station)?.picture(load(picture, Channel::default(), 8)?)?;
    println!("u_px,v_px,x_mm,y_mm,z_mm,sigma_mm");
    for (k, p) in shot.peaks.iter().zip(&shot.points).filter(|(k, _)| k.kept()) {
        let [x, y, z] = p.position.to_array();
        println!("{:.3},{:.3},{x:.4},{y:.4},{z:.4},{:.4}", k.u, k.v, p.sigma_mm);
    }
    Ok(())
}
