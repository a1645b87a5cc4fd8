//! In: the report of a found part. Out: its pose.
//! Frame and unit: the frame that the report names, mm.

use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::{Base, Part, Rigid};
use std::path::Path;

/// The fields that are read from a report; `find` writes more.
#[derive(serde::Deserialize)]
pub struct FoundPart {
    /// Name of the recipe.
    pub recipe: String,
    frame: String,
    passed: bool,
    reasons: Vec<String>,
    /// Pose of the part in the scan's frame, mm.
    pub base_from_part: Rigid<Base, Part>,
}

impl FoundPart {
    /// Reads the report (JSON) of a part found in a scan of this frame.
    ///
    /// # Errors
    /// A file of another kind, a pose that failed a gate, a pose in another frame.
    pub fn load(path: &Path, frame: &str) -> Result<FoundPart> {
        let found: FoundPart = serde_json::from_str(&sheetlight::files::read_text(path)?).map_err(|e| {
            Fault::input(format!("{}: is not the report of a part that was found: {e}", path.display()))
                .cause("another file, or the matches of sheetlight match, which are pixels and not poses")
                .next("give the file that sheetlight find --out wrote")
        })?;
        if !found.passed {
            return Err(Fault::refused(format!("{}: has no pose: {}", path.display(), found.reasons.join("; ")))
                .cause("a gate of the recipe was missed")
                .next("exclude this file, or find the part again"));
        }
        if found.frame != frame {
            return Err(Fault::input(format!(
                "{}: its pose is in the {} frame, the scan is in the {frame} frame",
                path.display(),
                found.frame
            ))
            .cause("the part was found in another scan")
            .next("give the report of a part of this scan"));
        }
        Ok(found)
    }
}
