//! In: a joint solve and its verdict. Out: the page for a person.
//! Frame and unit: mm, degrees, px.

use crate::calibrate::joint::limits::by_part;
use crate::calibrate::joint::shots::Part;
use crate::calibrate::joint::solve::JointFit;
use crate::calibrate::report::Page;
use crate::rig::Quality;
use nalgebra::DMatrix;

/// `weights` as in [`crate::calibrate::joint::volume::weights`].
pub fn page(fit: &JointFit, quality: &Quality, weights: &DMatrix<f64>) -> Page {
    let mut page = Page::new("Joint calibration");
    page.verdict(quality);
    let factors = fit.noise.factors();
    let scatter = |p: Part| match p {
        Part::RobotPlace => format!("{:.4} mm", factors[p as usize]),
        Part::RobotTurn => format!("{:.4} degrees", factors[p as usize].to_degrees()),
        _ => format!("{:.2} times the stated sigma", factors[p as usize]),
    };
    let rows: Vec<Vec<String>> = by_part(fit, weights)
        .into_iter()
        .filter(|(p, _)| fit.has(*p))
        .map(|(p, mm)| {
            vec![p.words().into(), format!("{mm:.4}"), scatter(p), format!("{:.0}", fit.freedom[p as usize])]
        })
        .collect();
    page.table(
        "What makes the error of a scanned point",
        &["source", "mm rms", "scatters by", "degrees of freedom"],
        &rows,
    );
    let yes = |b: bool| if b { "yes" } else { "" }.to_owned();
    let rows: Vec<Vec<String>> = fit
        .shots
        .iter()
        .map(|s| {
            let n = s.seen.points.len();
            vec![
                s.seen.name.clone(),
                n.to_string(),
                yes(s.robot.is_some()),
                yes(!s.stripe.is_empty()),
                yes(s.spot.is_some()),
            ]
        })
        .collect();
    page.table("Stops", &["picture", "corners", "robot", "stripe", "spot"], &rows);
    page
}
