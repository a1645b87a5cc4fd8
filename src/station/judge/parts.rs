//! In: a finished scan of a simulated station, recipes, the truth. Out: each part's insertion pose and its error.
//! Frame and unit: errors in the part's own axes; mm, degrees.

use crate::fault::Result;
use crate::find::{LocateOptions, Recipe};
use crate::simulate::Truth;
use crate::station::find::find_part;
use std::path::Path;

/// A part that was searched for.
#[derive(Clone, Debug, serde::Serialize)]
pub struct FoundPart {
    /// Name of the recipe.
    pub name: String,
    /// Title of the recipe, for display.
    pub title: String,
    /// Every gate of the recipe was met, so that there is a pose.
    pub passed: bool,
    /// Reasons if a gate was not met.
    pub reasons: Vec<String>,
    /// Found minus true position, along the part's x, y, z; `None` without truth or pose.
    pub error_mm: Option<[f64; 3]>,
    /// Angle between found and true pose, degrees.
    pub error_deg: Option<f64>,
    /// Sigmas that the report states, 1 sigma.
    pub sigma_mm: [f64; 3],
    /// The picture with the match drawn on the height map, beside the scan's other files.
    pub picture: String,
}

/// Finds the parts of `recipes` in a scan, writes `find_NAME.json` and `.png` beside it, and compares the poses
/// with the truth. A part that is not found is a result, not an error.
pub fn judge_parts(scan: &Path, station: &Path, truth: &Path, recipes: &[Recipe]) -> Result<Vec<FoundPart>> {
    let truth = Truth::load(truth)?;
    let mut out = Vec::new();
    for recipe in recipes {
        let picture = format!("find_{}.png", recipe.name);
        let mut found = FoundPart {
            name: recipe.name.clone(),
            title: recipe.title.clone(),
            passed: false,
            reasons: vec![],
            error_mm: None,
            error_deg: None,
            sigma_mm: [f64::NAN; 3],
            picture: String::new(),
        };
        match find_part(scan, recipe, Some(station), &LocateOptions::default()) {
            Err(fault) => found.reasons.push(fault.what),
            Ok((report, image)) => {
                let text = serde_json::to_string_pretty(&report).expect("plain data");
                let json = scan.join(format!("find_{}.json", recipe.name));
                crate::files::write_beside((&json, text.as_bytes()), &[(&scan.join(&picture), &image.to_png())])?;
                (found.passed, found.reasons) = (report.passed, report.reasons.clone());
                (found.sigma_mm, found.picture) = (report.sigma_mm, picture);
                if let Some(part) = truth.file.parts.iter().find(|p| p.name == recipe.name) {
                    let error = part.base_from_part.inverse() * report.base_from_part;
                    found.error_mm = Some(error.translation.into());
                    found.error_deg = Some(error.rotation_vector().norm().to_degrees());
                }
            }
        }
        out.push(found);
    }
    let text = serde_json::to_string_pretty(&out).expect("plain data");
    crate::files::write(&scan.join("found.json"), text.as_bytes())?;
    Ok(out)
}
