//! In: recordings of one camera. Out: the pixels that shine in all their pictures by themselves.
//! Frame and unit: px.

use super::Recording;
use crate::raster::HotPixels;
use rayon::prelude::*;

/// Pictures that are looked at, evenly taken: more would find the same pixels.
const MOST: usize = 24;

/// The hot pixels of the camera that took these recordings: of the pictures with the laser, where room light hides
/// fewer of them, else of all. Pictures that cannot be read are passed over.
pub fn hot_pixels(recordings: &[Recording]) -> HotPixels {
    let frames = || recordings.iter().flat_map(|r| r.meta.frames.iter().map(move |f| (r, f)));
    let mut pictures: Vec<(&Recording, &String)> = frames().filter_map(|(r, f)| Some((r, f.laser.as_ref()?))).collect();
    if pictures.len() < MOST {
        pictures.extend(frames().filter_map(|(r, f)| Some((r, f.ambient.as_ref()?))));
    }
    let step = pictures.len().div_ceil(MOST).max(1);
    let chosen: Vec<_> = pictures.into_iter().step_by(step).collect();
    let looked_at = chosen.par_iter().filter_map(|(recording, name)| {
        let image = recording.picture(name).ok()?;
        Some((HotPixels::may_be(&image), image.pixel_count()))
    });
    let (each, counts): (Vec<_>, Vec<_>) = looked_at.unzip();
    HotPixels::of_all(&each, counts.first().copied().unwrap_or(0))
}
