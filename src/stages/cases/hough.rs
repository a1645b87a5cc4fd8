//! In: the first three scenes. Out: the cases of the stage that finds straight lines. Frame and unit: words.

use super::scenes::scenes;
use super::walk::Walk;
use crate::stages::entry::Case;
use crate::stages::listing;
use crate::stages::stripe::hough::{HoughFrame, HoughParams};

/// Cases with the skeletons of the first three scenes.
pub fn cases() -> Vec<Case> {
    scenes()
        .iter()
        .take(3)
        .map(|scene| {
            let mut walk = Walk::new(scene);
            walk.run("");
            let f = walk.frame;
            let frame = HoughFrame::new(f.width, f.height, &HoughParams::default());
            let header = walk.buffers["header"].clone();
            let table = bytemuck::cast_slice(&frame.table()).to_vec();
            Case {
                name: scene.name.into(),
                overrides: Vec::new(),
                groups: [header[listing::COUNT].div_ceil(64).max(1), 1, 1],
                bindings: vec![
                    bytemuck::cast_slice(&[frame]).to_vec(),
                    header,
                    walk.buffers["pixels"].clone(),
                    table,
                    vec![0; (f.shots * frame.angles * frame.cells) as usize],
                ],
            }
        })
        .collect()
}
