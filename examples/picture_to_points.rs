//! One picture of the stripe and a station in; the stripe's points out, as CSV: pixel, point, standard deviation. No
//! robot: the points are in the camera's frame, mm.
//!
//!   cargo run --example picture_to_points -- PICTURE STATION

use sheetlight::fault::{Fault, Result};
use sheetlight::raster::{Channel, load};
use sheetlight::rig::Rig;
use sheetlight::scan::{Engine, Extraction, Format, Optical, Place, Where};
use std::path::PathBuf;

fn main() -> Result<()> {
    let paths: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [picture, station] = paths.as_slice() else {
        return Err(Fault::usage("a picture and a station are needed").next("give PICTURE STATION"));
    };
    let image = load(picture, Channel::default(), 8)?;
    let rig = Rig::load(station)?;
    let format = Format { width: image.width, height: image.height, bits: image.bits };
    let optical = Optical {
        camera: rig.need_camera()?.value,
        laser: rig.need_laser_plane()?.value,
        depth_mm: [1.0, f64::INFINITY],
    };
    let mut engine = Engine::new(format, &optical, &Extraction::default(), None, Where::Auto.open()?);
    let Some(seen) = engine.measure(&[&image]) else {
        return Err(Fault::input("no stripe is seen").next("look at exposure and laser"));
    };
    engine.set_stripe(&seen.stripe)?;
    engine.submit(0, image, Place::camera())?;
    println!("u_px,v_px,x_mm,y_mm,z_mm,sigma_mm");
    for shot in engine.collect(true)? {
        for (k, p) in shot.peaks.iter().zip(&shot.points).filter(|(k, _)| k.kept()) {
            let [x, y, z] = p.position.to_array();
            println!("{:.3},{:.3},{x:.4},{y:.4},{z:.4},{:.4}", k.u, k.v, p.sigma_mm);
        }
    }
    Ok(())
}
