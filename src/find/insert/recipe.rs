//! In: a recipe (TOML): what a part looks like, how it is searched and measured, what is constructed on it, where the
//! tool goes, and the quality that a pose must reach.
//! Out: the same, checked. Frame and unit: part frame; mm, degrees.

use crate::fault::{Fault, Result};
use crate::find::measure::construct;
use crate::find::measure::construct::Construction;
use crate::find::measure::options::MeasureOptions;
use crate::find::model::drawing::Drawing;
use crate::find::model::shape::Shape;
use crate::find::model::shape_model::ModelOptions;
use crate::find::scene::Kind;
use crate::find::search::options::SearchOptions;
use std::path::Path;

/// One task: a part and what is done with it.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// Version of this format: 1.
    pub format: u32,
    /// Name of the part in messages and files.
    pub name: String,
    /// Title for people; may be empty.
    #[serde(default)]
    pub title: String,
    /// Edge of a cell of the map that is searched, mm, 0.0001 to 500. About two sampling steps.
    pub cell_mm: f64,
    /// Layers that are searched. Default height alone.
    #[serde(default = "height")]
    pub layers: Vec<Kind>,
    /// Number of turns about z at which the part looks nearly alike (2: half a turn), 1 to 8. They are distinguished by
    /// what is seen where they differ.
    #[serde(default = "one")]
    pub alike_turns: u32,
    /// How the part is searched in the map.
    #[serde(default)]
    pub search: SearchOptions,
    /// How the drawing becomes the edge points of the search.
    #[serde(default)]
    pub model: ModelOptions,
    /// How the pose is measured on the points.
    #[serde(default)]
    pub measure: MeasureOptions,
    /// The drawing; the first shape lies on the datum surface.
    pub shape: Vec<Shape>,
    /// Points, lines and lattices built on the measured part; later ones may use earlier ones.
    #[serde(default)]
    pub construction: Vec<Construction>,
    /// Where the tool goes, and the tolerances of the insertion.
    pub insertion: InsertionSpec,
    /// Limits on quality; a pose that misses one is not reported.
    #[serde(default)]
    pub gates: Gates,
    /// What the robot adds to the uncertainty.
    #[serde(default)]
    pub robot: RobotSpec,
}

/// Where the tool goes.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InsertionSpec {
    /// "pose": the part's pose from all edges; or the name of a construction whose deviation moves it.
    #[serde(default = "pose")]
    pub construction: String,
    /// Name of the two-pin construction (the paper's); its disagreement with the lattice fit is reported and gated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub two_pin: Option<String>,
    /// Name of the lattice construction that `two_pin` is compared with.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lattice: Option<String>,
    /// The tool's origin in the part frame, mm.
    #[serde(default)]
    pub offset_mm: [f64; 3],
    /// The tool's turn about the part's z, degrees.
    #[serde(default)]
    pub turn_deg: f64,
    /// Distance of the approach pose above the insertion pose along the part's z, mm, [`InsertionSpec::least_above_mm`]
    /// to 1000.
    pub approach_mm: f64,
    /// The same distance for the retract pose.
    pub retract_mm: f64,
    /// Tolerance of the insertion in the plane, mm, 0.0001 to 100: 3 sigma must stay within it.
    pub tolerance_mm: f64,
    /// Tolerance of any turn, degrees, 0.001 to 10: 3 sigma must stay within it.
    pub tolerance_deg: f64,
}

impl InsertionSpec {
    /// The tool goes to the part's own pose. `tolerance` holds in the plane, mm, and as a turn, degrees; the distances
    /// are above the pose, mm.
    pub fn at_the_part(tolerance: (f64, f64), approach_mm: f64, retract_mm: f64) -> InsertionSpec {
        InsertionSpec {
            construction: pose(),
            two_pin: None,
            lattice: None,
            offset_mm: [0.0; 3],
            turn_deg: 0.0,
            approach_mm,
            retract_mm,
            tolerance_mm: tolerance.0,
            tolerance_deg: tolerance.1,
        }
    }
}

impl Recipe {
    /// A recipe from a drawing and a task; all else, including the gates, has its default value.
    pub fn new(name: &str, cell_mm: f64, shape: Vec<Shape>, insertion: InsertionSpec) -> Recipe {
        Recipe {
            format: 1,
            name: name.into(),
            title: String::new(),
            cell_mm,
            layers: height(),
            alike_turns: one(),
            search: Default::default(),
            model: Default::default(),
            measure: Default::default(),
            shape,
            construction: Vec::new(),
            insertion,
            gates: Gates::default(),
            robot: RobotSpec::default(),
        }
    }
}

/// Limits on quality: no pose is reported when one of them is missed.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Gates {
    /// Least search score, 0 to 1.
    pub min_score: f64,
    /// Least lead over the best other pose, 1 - second / first, 0 to 1; alike turns are decided separately.
    pub min_margin: f64,
    /// Largest standard deviation in the plane and along z, mm.
    pub max_sigma_mm: f64,
    /// Largest standard deviation of any turn, degrees.
    pub max_sigma_deg: f64,
    /// Least share of the part's surfaces that was seen, 0 to 1.
    pub min_coverage: f64,
    /// Least share of points at and beside the part that lie where the drawing says, 0 to 1.
    pub min_agreement: f64,
    /// Least share of the drawn edges at which a surface was seen to end, 0 to 1.
    pub min_edges: f64,
    /// Largest share of the drawn edges beyond which the surface goes on, 0 to 1.
    pub max_crossed: f64,
    /// Largest disagreement between the two-pin construction and the lattice fit beyond their own noise, mm.
    pub max_disagreement_mm: f64,
    /// False lets a part pass whose alike turns could not be distinguished.
    pub turn_must_be_told: bool,
    /// True refuses a pose that rests on one scan alone.
    pub second_look: bool,
    /// Largest disagreement of two scans relative to what all covariances predict, 1 to 10.
    pub max_look_ratio: f64,
    /// Least turn about the part's normal from one scan to the other, degrees, 0 to 180: scans from one side repeat the
    /// same error.
    pub min_look_turn_deg: f64,
    /// Least tilt against the part's normal from one scan to the other, degrees, 0 to 60.
    pub min_look_tilt_deg: f64,
    /// Largest error along the part's normal that several scans may leave undetected, mm, 0.00001 to 100. In the plane
    /// and as a turn, the insertion's tolerances are the limits.
    pub max_unseen_height_mm: f64,
}

impl Default for Gates {
    fn default() -> Self {
        Gates {
            min_score: 0.5,
            min_margin: 0.04,
            max_sigma_mm: 0.08,
            max_sigma_deg: 0.2,
            min_coverage: 0.3,
            min_agreement: 0.9,
            min_edges: 0.15,
            max_crossed: 0.05,
            max_disagreement_mm: 0.2,
            turn_must_be_told: true,
            second_look: false,
            max_look_ratio: 3.0,
            min_look_turn_deg: 60.0,
            min_look_tilt_deg: 10.0,
            max_unseen_height_mm: 2.0,
        }
    }
}

/// What the robot itself adds to the uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RobotSpec {
    /// Standard deviation of a reached position, mm, 0 to 10: the robot's repeatability.
    pub sigma_mm: f64,
    /// Standard deviation of a reached turn about each axis, degrees, 0 to 10.
    pub sigma_deg: f64,
}

impl Default for RobotSpec {
    fn default() -> Self {
        RobotSpec { sigma_mm: 0.02, sigma_deg: 0.004 }
    }
}

fn height() -> Vec<Kind> {
    vec![Kind::Height]
}
fn one() -> u32 {
    1
}
fn pose() -> String {
    "pose".into()
}

impl Recipe {
    /// Reads a recipe from a file.
    ///
    /// # Errors
    /// A file that cannot be read, and what [`Recipe::parse`] refuses.
    pub fn load(path: &Path) -> Result<Recipe> {
        let text = crate::files::read_text(path)?;
        Recipe::parse(&text).map_err(|e| e.at(path.display()))
    }

    /// Parses and checks; unknown keys and impossible constructions are refused.
    pub fn parse(text: &str) -> Result<Recipe> {
        let recipe: Recipe = toml::from_str(text).map_err(|e| {
            Fault::input(format!("is not a recipe: {}", e.to_string().trim_end()))
                .cause(crate::files::slip_at(
                    text,
                    e.span().map_or(0, |s| s.start),
                    "a misspelt key, a missing entry, or a value of the wrong type",
                ))
                .next("compare it with docs/file-formats.md, Recipe")
        })?;
        recipe.check()?;
        Ok(recipe)
    }

    /// The shapes alone; part frame, mm.
    pub fn drawing(&self) -> Drawing {
        Drawing { shape: self.shape.clone() }
    }

    /// Refuses values out of range, a drawing without a surface, and names that refer to nothing.
    pub fn check(&self) -> Result<()> {
        range("format", f64::from(self.format), 1.0, 1.0)?;
        crate::files::named("name", &self.name)?;
        range("cell_mm", self.cell_mm, 1e-4, 500.0)?;
        range("alike_turns", f64::from(self.alike_turns), 1.0, 8.0)?;
        if self.layers.is_empty() {
            return Err(Fault::input("layers is empty").next("name height, intensity or both"));
        }
        self.search.check()?;
        self.model.check()?;
        self.measure.check()?;
        let drawing = self.drawing();
        drawing.check()?;
        // Coarser cells cannot resolve the part.
        let b = drawing.bounds();
        range("cell_mm", self.cell_mm, 0.0, (b[2] - b[0]).max(b[3] - b[1]) / 8.0)?;
        if drawing.faces().is_empty() {
            return Err(Fault::input("the recipe draws no surface: nothing gives height and tilt")
                .cause("only lines, arcs or shapes with inside = \"either\"")
                .next("draw the datum surface first, as a rectangle, circle or polygon"));
        }
        construct::check(&self.construction, &drawing)?;
        self.insertion.check(&self.construction, &drawing)?;
        self.gates.check()?;
        range("robot.sigma_mm", self.robot.sigma_mm, 0.0, 10.0)?;
        range("robot.sigma_deg", self.robot.sigma_deg, 0.0, 10.0)
    }
}

fn range(name: &str, v: f64, a: f64, b: f64) -> Result<()> {
    if (a..=b).contains(&v) {
        Ok(())
    } else {
        Err(Fault::input(format!("{name} is {v}; allowed: {a} to {b}")).next("correct the recipe"))
    }
}

/// An arm counts as arrived within 0.2 mm of its target (docs/robots.md). The errors at the part and above it may add
/// up, and a tenth of a millimetre is left as clearance.
const CLEAR_MM: f64 = 0.5;
/// Beyond this distance the tool has left the part's surroundings.
const MOST_ABOVE_MM: f64 = 1000.0;

fn above(name: &str, mm: f64, least: f64) -> Result<()> {
    if (least..=MOST_ABOVE_MM).contains(&mm) {
        return Ok(());
    }
    Err(Fault::input(format!("insertion.{name} is {mm}; allowed: {least:.3} to {MOST_ABOVE_MM}"))
        .cause(format!(
            "below {least:.3} mm, the drawn depth of the part and {CLEAR_MM} mm, the tool there is not clear of the \
             part"
        ))
        .next(format!("set {name} in the recipe to more than the component reaches into the part, 30 for example")))
}

impl InsertionSpec {
    /// Least distance above the insertion pose at which the tool is clear of the part, mm. It reaches from the lowest
    /// of the drawn shapes and the insertion pose to the highest drawn shape, plus a clearance. The length of the
    /// component is unknown: it may need more.
    pub fn least_above_mm(&self, drawing: &Drawing) -> f64 {
        let heights = drawing.shape.iter().map(|s| s.z_mm);
        let low = heights.clone().fold(self.offset_mm[2], f64::min);
        let high = heights.fold(f64::NEG_INFINITY, f64::max);
        (high - low).max(0.0) + CLEAR_MM
    }

    /// Refuses values out of range, and names that refer to no construction.
    fn check(&self, constructions: &[Construction], drawing: &Drawing) -> Result<()> {
        range("offset_mm", self.offset_mm[2], -1e4, 1e4)?;
        let least = self.least_above_mm(drawing);
        for (name, mm) in [("approach_mm", self.approach_mm), ("retract_mm", self.retract_mm)] {
            above(name, mm, least)?;
        }
        range("tolerance_mm", self.tolerance_mm, 1e-4, 100.0)?;
        range("tolerance_deg", self.tolerance_deg, 1e-3, 10.0)?;
        range("turn_deg", self.turn_deg, -360.0, 360.0)?;
        for o in self.offset_mm {
            range("offset_mm", o, -1e4, 1e4)?;
        }
        let named = [Some(&self.construction).filter(|n| *n != "pose"), self.two_pin.as_ref(), self.lattice.as_ref()];
        for name in named.into_iter().flatten() {
            if !constructions.iter().any(|c| c.name == *name) {
                return Err(Fault::input(format!("the insertion refers to '{name}', which is not a construction"))
                    .cause("a misspelt name")
                    .next("add it under [[construction]]"));
            }
        }
        Ok(())
    }
}

impl Gates {
    fn check(&self) -> Result<()> {
        for (name, v) in [
            ("gates.min_score", self.min_score),
            ("gates.min_margin", self.min_margin),
            ("gates.min_coverage", self.min_coverage),
            ("gates.min_agreement", self.min_agreement),
            ("gates.min_edges", self.min_edges),
            ("gates.max_crossed", self.max_crossed),
        ] {
            range(name, v, 0.0, 1.0)?;
        }
        range("gates.max_sigma_mm", self.max_sigma_mm, 1e-5, 100.0)?;
        range("gates.max_sigma_deg", self.max_sigma_deg, 1e-4, 10.0)?;
        range("gates.max_disagreement_mm", self.max_disagreement_mm, 1e-5, 100.0)?;
        range("gates.max_look_ratio", self.max_look_ratio, 1.0, 10.0)?;
        range("gates.min_look_turn_deg", self.min_look_turn_deg, 0.0, 180.0)?;
        range("gates.min_look_tilt_deg", self.min_look_tilt_deg, 0.0, 60.0)?;
        range("gates.max_unseen_height_mm", self.max_unseen_height_mm, 1e-5, 100.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(text: &str, approach: &str, retract: &str) -> Result<Recipe> {
        let text = text.replace("approach_mm = 40", &format!("approach_mm = {approach}"));
        Recipe::parse(&text.replace("retract_mm = 80", &format!("retract_mm = {retract}")))
    }

    /// A retract pose equal to the insertion pose leaves the tool in the part; an approach pose equal to it inserts the
    /// tool unasked.
    #[test]
    fn the_tool_is_above_the_part_before_and_after() {
        let dimm = include_str!("../../../data/recipes/dimm.toml");
        // Drawn from 0.35 mm below the datum to 8 mm above it.
        let least = 8.35 + CLEAR_MM;
        let ok = with(dimm, &format!("{least}"), "80").unwrap();
        assert!((ok.insertion.least_above_mm(&ok.drawing()) - least).abs() < 1e-12);
        for (approach, retract, names) in [
            ("0", "80", "approach_mm is 0;"),
            ("40", "0", "retract_mm is 0;"),
            ("40", "8.84", "retract_mm is 8.84"),
            ("nan", "80", "approach_mm is NaN"),
            ("40", "nan", "retract_mm is NaN"),
            ("40", "inf", "retract_mm is inf"),
            ("-40", "80", "approach_mm is -40"),
        ] {
            let fault = with(dimm, approach, retract).unwrap_err();
            let says = fault.what.contains(names) && fault.what.contains("8.850 to 1000");
            assert!(says && fault.next.contains("in the recipe to more than"), "{fault}");
        }
        // The tool's origin is high above the part, as with a long component in it: the way up is just as long.
        let high = dimm.replace("[insertion]", "[insertion]\noffset_mm = [0, 0, 20]");
        assert!(with(&high, "40", "8.84").is_err() && with(&high, "40", "8.86").is_ok());
        // The tool's origin is far below what is drawn: the tool has to come up from there.
        let deep = dimm.replace("[insertion]", "[insertion]\noffset_mm = [0, 0, -10]");
        assert!(with(&deep, "40", "18.4").is_err() && with(&deep, "40", "18.6").is_ok());
    }
}
