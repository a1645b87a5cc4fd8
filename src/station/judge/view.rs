//! In: a scan's points and its height map. Out: the interactive 3-D view of its page, turned with the mouse.
//! Frame and unit: the map's frame about its middle, mm.

use super::embed::{base64, thousands};
use crate::fault::Result;
use crate::geometry::Vec3;
use crate::scan::{CloudFile, HeightMap, PointSource};
use maud::{Markup, PreEscaped, html};
use std::path::Path;

/// Most points in the 3-D view; every k-th point of the cloud is taken.
const VIEW_POINTS: u64 = 120_000;
/// Resolution of a coordinate, mm: 16 bits reach 655 mm to each side.
const STEP: f64 = 0.02;
const VIEWER: &str = include_str!("viewer.js");

/// A canvas that shows the points.
pub(super) fn of(scan: &Path, map: &HeightMap) -> Result<Markup> {
    let cloud = CloudFile::open(&scan.join("cloud.ply"))?;
    let grid_from_base = map.base_from_grid.inverse();
    let (low, high) = map.quantiles(0.005, 0.995).unwrap_or((0.0, 1.0));
    let low = low - 0.12 * (high - low);
    let middle = Vec3::new(0.5 * f64::from(map.width) * map.cell, 0.5 * f64::from(map.height) * map.cell, 0.0);
    let every = cloud.count().div_ceil(VIEW_POINTS).max(1);
    let (mut bytes, mut i) = (Vec::new(), 0u64);
    cloud.for_each_chunk(&mut |chunk| {
        for p in chunk {
            i += 1;
            if (i - 1) % every != 0 {
                continue;
            }
            let q = grid_from_base.point(&p.at()) - middle;
            q.iter().for_each(|x| bytes.extend(((x / STEP).round().clamp(-32_767.0, 32_767.0) as i16).to_le_bytes()));
        }
    })?;
    let stops: Vec<[u8; 3]> = (0..32).map(|i| crate::raster::colour::ordered(i as f32 / 31.0)).collect();
    let stops = serde_json::to_string(&stops).expect("numbers");
    let data = format!("const B=\"{}\",STEP={STEP},LOW={low},HIGH={high},MAP={stops};", base64(&bytes));
    Ok(html! {
        figure {
            canvas id="view" width="1100" height="560" {}
            figcaption {
                "The points themselves (" (thousands(bytes.len() as u64 / 6)) " of " (thousands(cloud.count()))
                "): drag to turn, wheel to zoom."
            }
        }
        script { (PreEscaped(data)) (PreEscaped(VIEWER)) }
    })
}
