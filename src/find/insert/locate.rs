//! In: a scan's points, a recipe, optionally the rig's calibrations. Out: where the tool goes, how certain that is and
//! why, or a refusal: no pose is reported when a gate failed.
//! Frame and unit: base frame; mm, degrees; sigmas along the part's own axes.

use super::budget::{Budget, budget};
use super::hypothesis::{Judged, best_hypothesis, lead};
use super::places::places;
use super::recipe::{Gates, Recipe};
pub use super::report::{Poses, Report, RobotPose};
use super::rim::{CutOff, cut_off};
use super::verdict::{Agreement, TurnVote, judge, vote};
use crate::fault::{Fault, Gate, Result};
use crate::find::look::looks::{self, Agreed, Look, Witness};
use crate::find::look::part_seen::towards_camera;
use crate::find::look::size_check::SizeCheck;
use crate::find::measure::construct::{Built, build, features};
use crate::find::measure::points::Ordered;
use crate::find::measure::pose::{Measured, measure};
use crate::find::model::drawing::Drawing;
use crate::find::model::mirror::own_mirror_image;
use crate::find::model::shape_model::ShapeModel;
use crate::find::scene::{Kind, Layer, Scene};
use crate::find::search::accelerator::Accelerator;
use crate::find::search::full::{Match, find_on};
use crate::find::search::options::SearchOptions;
use crate::geometry::{Base, Part, Rigid, Tool, Vec3};
use crate::rig::Rig;
use crate::robot::Convention;
use crate::scan::{CloudPoint, GridOptions, HeightMap, Shots, grid};

/// Words of the fault of a scan in which no place looks like the part.
pub const NOT_FOUND: &str = "was not found: nothing scores";

/// What else is known about a scan.
#[derive(Clone, Debug)]
pub struct LocateOptions {
    /// Direction towards the camera in the base frame, unit length not needed. Default: the direction in which the
    /// camera was during the scan, or z where its pose is unknown.
    pub up: Option<Vec3>,
    /// Notation of the poses for the robot. Default the 4x4 matrix.
    pub robot: Convention,
    /// A GPU for the coarse search; the result is the same without.
    pub accelerator: Option<Accelerator>,
    /// The part's pose from another scan, which is tried before what the search finds. From the side a part hides some
    /// of its own edges, and the best match may lie beside it.
    pub expected: Option<Rigid<Base, Part>>,
    /// Whether to list every place that looks like the part.
    pub all: bool,
}

impl Default for LocateOptions {
    fn default() -> Self {
        LocateOptions { up: None, robot: Convention::Matrix, accelerator: None, expected: None, all: false }
    }
}

impl LocateOptions {
    /// Options for another scan of the part of `first`: the height axis remains that part's normal, and the part is
    /// expected at the same pose.
    pub fn again(self, first: &Report) -> LocateOptions {
        let up = self.up.or_else(|| Some(first.base_from_part.direction(&Vec3::z())));
        LocateOptions { up, expected: Some(first.base_from_part), ..self }
    }
}

/// Finds the part of a recipe in a cloud. A part that is absent, or is seen too poorly to be measured, is a `Fault`. A
/// part that was measured but misses a gate gives a report without poses. Both state whether the part extends beyond
/// the rim of the scan.
pub fn locate(
    cloud: &[CloudPoint],
    shots: &Shots,
    recipe: &Recipe,
    rig: Option<&Rig>,
    options: &LocateOptions,
) -> Result<Report> {
    let (points, map) = seen(cloud, shots, recipe, options)?;
    let located = located(&points, &map, recipe, rig, options);
    if located.as_ref().is_ok_and(|report| report.passed) {
        return located;
    }
    let cut_off = partly(&points, &map, recipe, options)?;
    match (located, cut_off) {
        (Err(_), Some(cut)) => Err(cut.fault(&recipe.name)),
        (located, cut_off) => located.map(|mut report| {
            report.reasons.splice(..0, cut_off.as_ref().map(CutOff::words));
            Report { cut_off, ..report }
        }),
    }
}

/// Whether the part extends beyond the rim of a scan in which it was not found or not measured well enough.
///
/// # Errors
/// Those of [`locate`] for a cloud or a recipe that cannot be used.
pub fn beyond_rim(
    cloud: &[CloudPoint],
    shots: &Shots,
    recipe: &Recipe,
    options: &LocateOptions,
) -> Result<Option<CutOff>> {
    let (points, map) = seen(cloud, shots, recipe, options)?;
    partly(&points, &map, recipe, options)
}

pub(super) fn seen(
    cloud: &[CloudPoint],
    shots: &Shots,
    recipe: &Recipe,
    options: &LocateOptions,
) -> Result<(Ordered, HeightMap)> {
    recipe.check()?;
    let points = Ordered::new(cloud, shots)?;
    let up = options.up.or_else(|| towards_camera(&points)).unwrap_or_else(Vec3::z);
    let map = grid(cloud, &GridOptions { cell: Some(recipe.cell_mm), up, ..GridOptions::default() })?;
    Ok((points, map))
}

fn located(
    points: &Ordered,
    map: &HeightMap,
    recipe: &Recipe,
    rig: Option<&Rig>,
    options: &LocateOptions,
) -> Result<Report> {
    let least = recipe.search.min_score.min(recipe.gates.min_score);
    let matches = search(map, recipe, options, least)?;
    if matches.is_empty() {
        return Err(Fault::refused(format!("'{}' {NOT_FOUND} {least:.2} or more", recipe.name))
            .cause("the part is missing, different, hidden, outside the scan, or the scan has a wrong scale")
            .next(
                "look at the height map and measure a known length in it: if it is wrong, check the stated sizes of \
                 the calibration boards; otherwise scan or teach the part again",
            ));
    }
    let all = if options.all { places(&matches, map) } else { vec![] };
    let part = examine(points, map, recipe, options.expected.as_ref(), &matches)?;
    let report = conclude(recipe, rig, options, points, map, part)?;
    Ok(Report { all, ..report })
}

/// A part that extends beyond the rim, among the places that score as a part with a missing piece does.
fn partly(points: &Ordered, map: &HeightMap, recipe: &Recipe, options: &LocateOptions) -> Result<Option<CutOff>> {
    /// Share of the usual score limit. Edges beyond the rim are places without a slope, which count half.
    const OF_A_PIECE: f64 = 0.6;
    let least = OF_A_PIECE * recipe.search.min_score.min(recipe.gates.min_score);
    Ok(cut_off(points, map, recipe, &search(map, recipe, options, least)?))
}

/// Places of a height map that look like the part, best first.
pub(super) fn search(map: &HeightMap, recipe: &Recipe, options: &LocateOptions, least: f64) -> Result<Vec<Match>> {
    let scene = scene_of(map, &recipe.layers)?;
    let model = model_of(recipe, &scene)?;
    let mut search = recipe.search;
    search.max_matches = search.max_matches.max(3);
    if options.all {
        search.max_matches = SearchOptions::MOST_MATCHES;
        search.candidates = search.candidates.max(2000);
    }
    search.min_score = least;
    find_on(&scene, &model, &search, options.accelerator.as_ref())
}

/// The layers of a height map that a recipe names.
pub fn scene_of(map: &HeightMap, layers: &[Kind]) -> Result<Scene> {
    let (w, h) = (map.width as usize, map.height as usize);
    let layers = layers
        .iter()
        .map(|kind| Layer::new(*kind, w, h, if *kind == Kind::Height { map.z.clone() } else { map.intensity.clone() }))
        .collect::<Result<Vec<_>>>()?;
    Scene::new(layers, Some(map.cell))
}

fn model_of(recipe: &Recipe, scene: &Scene) -> Result<ShapeModel> {
    let mm = scene.mm_per_px.unwrap_or(recipe.cell_mm);
    let mut models = recipe
        .layers
        .iter()
        .map(|kind| ShapeModel::from_drawing(&recipe.drawing(), mm, *kind, &recipe.model))
        .collect::<Result<Vec<_>>>()?;
    let mut model = models.remove(0);
    for other in models {
        for (mine, theirs) in model.levels.iter_mut().zip(other.levels) {
            mine.extend(theirs);
        }
    }
    Ok(model)
}

/// A match with its pose as measured on the points, and what the points show there.
struct Examined {
    found: Match,
    measured: Measured,
    agreement: Agreement,
    turns: Vec<TurnVote>,
    constructions: Vec<Built>,
    notes: Vec<String>,
}

/// Measures the part, decides which of its alike turns it has, and builds the recipe's constructions on it.
fn examine(
    points: &Ordered,
    map: &HeightMap,
    recipe: &Recipe,
    expected: Option<&Rigid<Base, Part>>,
    matches: &[Match],
) -> Result<Examined> {
    let drawing = recipe.drawing();
    let mut notes = Vec::new();
    if matches.len() > 1 {
        notes.push(format!(
            "{} places look like the part, scores {}; the best was taken",
            matches.len(),
            matches.iter().take(8).map(|m| format!("{:.3}", m.score)).collect::<Vec<_>>().join(" ")
        ));
    }
    let Judged { found, measured } = best_hypothesis(points, map, recipe, expected, &matches[0], matches)?;
    let (measured, turns) = right_way_round(points, recipe, expected.is_some(), measured, &mut notes)?;
    let agreement = judge(points, &drawing, &measured, &recipe.measure);
    let constructions = construct(recipe, &drawing, &measured, &mut notes)?;
    Ok(Examined { found, measured, agreement, turns, constructions, notes })
}

/// The pose as measured or turned, as decided by the points where the two differ. If too few points decide at the
/// measured pose, the turned pose is tried, unless the measured one was expected. In that case the last digit of a
/// score chose between the two, and neither pose is quite right.
fn right_way_round(
    points: &Ordered,
    recipe: &Recipe,
    expected: bool,
    measured: Measured,
    notes: &mut Vec<String>,
) -> Result<(Measured, Vec<TurnVote>)> {
    let drawing = recipe.drawing();
    let votes = |m: &Measured| vote(points, &drawing, &m.base_from_part, recipe.alike_turns, &recipe.measure);
    let turned = |t: &TurnVote| {
        let back: Rigid<Part, Part> =
            Rigid::from_vectors(&Vec3::new(0.0, 0.0, t.rival_deg.to_radians()), Vec3::zeros());
        measure(points, &drawing, measured.base_from_part * back, &recipe.measure)
    };
    let mut note = |t: &TurnVote, say: usize, of: &TurnVote| {
        let all = of.votes_for + of.votes_against;
        notes.push(format!(
            "turned by {:.0} degrees: {say} of the {all} points that distinguish the turns support it",
            t.rival_deg
        ));
    };
    let turns = votes(&measured);
    if let Some(t) = turns.iter().find(|t| t.told() == Some(false)) {
        note(t, t.votes_against, t);
        let other = turned(t)?;
        let turns = votes(&other);
        return Ok((other, turns));
    }
    for t in turns.iter().filter(|t| t.told().is_none() && !expected) {
        let Ok(other) = turned(t) else { continue };
        let theirs = votes(&other);
        if theirs.iter().all(|t| t.told() == Some(true)) {
            let least = theirs.iter().min_by_key(|t| t.votes_for).expect("one a turn");
            note(t, least.votes_for, least);
            return Ok((other, theirs));
        }
    }
    Ok((measured, turns))
}

/// Builds the recipe's constructions. One that cannot be built is skipped, unless it is the one that the insertion
/// uses.
fn construct(recipe: &Recipe, drawing: &Drawing, measured: &Measured, notes: &mut Vec<String>) -> Result<Vec<Built>> {
    let seen = features(&measured.observations, measured.growth, &recipe.measure);
    let mut constructions: Vec<Built> = Vec::new();
    for c in &recipe.construction {
        let earlier = recipe.construction.iter().take_while(|o| o.name != c.name);
        let usable: Vec<_> = earlier.filter(|e| constructions.iter().any(|b| b.name == e.name)).cloned().collect();
        match build(&[usable, vec![c.clone()]].concat(), drawing, &seen, &recipe.measure) {
            Ok(mut all) => constructions.push(all.pop().expect("one was asked for")),
            Err(e) if recipe.insertion.construction == c.name => return Err(e),
            Err(e) => notes.push(e.what),
        }
    }
    Ok(constructions)
}

fn conclude(
    recipe: &Recipe,
    rig: Option<&Rig>,
    options: &LocateOptions,
    points: &Ordered,
    map: &HeightMap,
    part: Examined,
) -> Result<Report> {
    let spec = &recipe.insertion;
    let used = part.constructions.iter().find(|b| b.name == spec.construction);
    let mut budget = budget(points, &part.measured, rig, recipe)?;
    part.constructions.iter().filter(|b| b.name == spec.construction).for_each(|b| budget.built(b));
    let sizes = size_check(&budget, recipe);
    let disagreement = disagreement(recipe, &part.constructions);
    let lead = lead(points, map, recipe, &part.found, &part.measured.base_from_part, &part.agreement);
    let mut gates = gates(&recipe.gates, &part, lead, &budget, disagreement);
    // Where another scan states the part's pose, no other place is in question: the scans have to agree.
    gates.retain(|g| options.expected.is_none() || g.name != "margin");
    gates.extend(sizes.as_ref().map(|s| s.gate(&recipe.gates)));
    let reasons: Vec<String> =
        missed(&gates).chain(gates.iter().filter(|g| g.name == LOOKS).map(Gate::words)).collect();
    let base_from_constructed = part.measured.base_from_part * used.map_or_else(Rigid::identity, moved_by);
    let Examined { found, measured, agreement, turns, constructions, mut notes } = part;
    notes.push(ONE_LOOK.into());
    notes.extend(sizes.as_ref().and_then(SizeCheck::silent));
    if own_mirror_image(&recipe.drawing()) {
        notes.push(SAME_IN_A_MIRROR.into());
    }
    let passed = reasons.is_empty();
    Ok(Report {
        recipe: recipe.name.clone(),
        frame: "base".into(),
        passed,
        reasons,
        poses: passed.then(|| poses_at(&base_from_constructed, recipe, options.robot)),
        within_tolerance: within_tolerance(recipe, budget.sigma_mm, budget.sigma_deg),
        tolerance_mm: spec.tolerance_mm,
        tolerance_deg: spec.tolerance_deg,
        sigma_mm: budget.sigma_mm,
        sigma_deg: budget.sigma_deg,
        budget,
        gates,
        base_from_part: measured.base_from_part,
        found,
        all: vec![],
        agreement,
        turns,
        constructions,
        disagreement_mm: disagreement.map(|(apart, _)| apart),
        disagreement_noise_mm: disagreement.map(|(_, noise)| noise),
        edges: measured.edges,
        edge_rms_mm: measured.edge_rms,
        surface_points: measured.surface_points,
        surface_rms_mm: measured.surface_rms,
        growth_mm: measured.growth,
        notes,
        sizes,
        looks: None,
        cut_off: None,
        base_from_constructed,
        map: map.clone(),
    })
}

/// Distance between the two-pin construction and the lattice, mm, and the distance expected from their own noise;
/// `None` where one of them is missing.
fn disagreement(recipe: &Recipe, constructions: &[Built]) -> Option<(f64, f64)> {
    let named = |name: &Option<String>| constructions.iter().find(|b| Some(&b.name) == name.as_ref());
    let (a, b) = (named(&recipe.insertion.two_pin)?, named(&recipe.insertion.lattice)?);
    let apart = (a.deviation_mm[0] - b.deviation_mm[0]).hypot(a.deviation_mm[1] - b.deviation_mm[1]);
    // The sigmas hold along each of two axes.
    Some((apart, std::f64::consts::SQRT_2 * a.measured.sigma_mm.hypot(b.measured.sigma_mm)))
}

/// A distance after the noise expected in it is subtracted, in quadrature.
fn beyond_noise((apart, noise): (f64, f64)) -> f64 {
    (apart * apart - noise * noise).max(0.0).sqrt()
}

/// The motion of the part's pose in its plane that brings a construction's nominal place to the measured one.
fn moved_by(b: &Built) -> Rigid<Part, Part> {
    let turn = b.deviation_deg.unwrap_or(0.0).to_radians();
    let (s, c) = turn.sin_cos();
    let (x, y) = (b.nominal.x, b.nominal.y);
    Rigid::from_vectors(
        &Vec3::new(0.0, 0.0, turn),
        Vec3::new(b.measured.x - (c * x - s * y), b.measured.y - (s * x + c * y), 0.0),
    )
}

/// The part's sizes compared with what the calibrations predict. Deviations come from the robot and the camera as much
/// as from the part.
fn size_check(budget: &Budget, recipe: &Recipe) -> Option<SizeCheck> {
    let (shape, seen) = (budget.shape.as_ref()?, budget.seen.as_ref()?);
    Some(SizeCheck::new(shape, &budget.levers, &seen.scan_axes(), recipe.measure.size_sigma))
}

/// Note on a pose that rests on one scan.
const ONE_LOOK: &str = "not cross-checked: one look cannot show what calibrations, delay, convention or robot got \
                        wrong; \
    plan a second one with sheetlight second-look";

/// Note on a part that cannot reveal mirrored pictures.
const SAME_IN_A_MIRROR: &str =
    "the part is its own mirror image: one look cannot tell mirrored pictures (ReverseX, ReverseY)";

/// The tool's poses for a part whose pose is known.
fn poses_at(base_from_part: &Rigid<Base, Part>, recipe: &Recipe, robot: Convention) -> Poses {
    let spec = &recipe.insertion;
    let part_from_tool: Rigid<Part, Tool> =
        Rigid::from_vectors(&Vec3::new(0.0, 0.0, spec.turn_deg.to_radians()), Vec3::from(spec.offset_mm));
    let base_from_tool = *base_from_part * part_from_tool;
    let above = |mm: f64| base_from_tool * Rigid::<Tool, Tool>::from_vectors(&Vec3::zeros(), Vec3::new(0.0, 0.0, mm));
    let write = |pose: Rigid<Base, Tool>| RobotPose {
        base_from_tool: pose,
        convention: robot.name(),
        labels: robot.labels(),
        numbers: robot.write(&pose),
    };
    Poses {
        insertion: write(base_from_tool),
        approach: write(above(spec.approach_mm)),
        retract: write(above(spec.retract_mm)),
    }
}

/// True where three standard deviations lie within the insertion's tolerances.
fn within_tolerance(recipe: &Recipe, sigma_mm: [f64; 3], sigma_deg: [f64; 3]) -> bool {
    let turn = sigma_deg.iter().copied().fold(0.0, f64::max);
    3.0 * sigma_mm[0].max(sigma_mm[1]) <= recipe.insertion.tolerance_mm && 3.0 * turn <= recipe.insertion.tolerance_deg
}

/// One report from several scans of the same part: the agreed pose, the disagreement between the scans, and the gates
/// on it. Every scan must have passed its own gates. Errors: an empty list, or a covariance that cannot be inverted.
pub fn agree(reports: Vec<Report>, witness: Option<&Witness>, recipe: &Recipe, robot: Convention) -> Result<Report> {
    let looks: Vec<Look> =
        reports.iter().map(|r| Look { base_from_part: r.base_from_constructed, budget: &r.budget }).collect();
    let Agreed { base_from_part, covariance, disagreement } =
        looks::agree(&looks, witness, recipe.measure.size_sigma, recipe.gates.max_look_ratio)?;
    let reasons: Vec<String> =
        (1..).zip(&reports).flat_map(|(k, r)| missed(&r.gates).map(move |why| format!("look {k}: {why}"))).collect();
    let mut report = reports.into_iter().next().expect("looks agree about one part at least");
    let alone = disagreement.looks < 2;
    report.notes.retain(|n| alone || ![ONE_LOOK, SAME_IN_A_MIRROR].contains(&n.as_str()));
    if alone {
        report.notes.push("the height was cross-checked by the pointer, nothing else was".into());
    }
    let second = disagreement.gates(recipe);
    report.reasons = reasons;
    report.reasons.extend(second.iter().filter(|g| !g.passed).map(Gate::words));
    report.gates.retain(|g| alone || g.name != LOOKS);
    report.reasons.extend(report.gates.iter().filter(|g| g.name == LOOKS && !g.passed).map(Gate::words));
    report.gates.extend(second);
    report.passed = report.reasons.is_empty();
    [report.sigma_mm, report.sigma_deg] = crate::find::insert::budget::sigmas(&covariance);
    report.base_from_part = base_from_part;
    report.base_from_constructed = base_from_part;
    report.within_tolerance = within_tolerance(recipe, report.sigma_mm, report.sigma_deg);
    report.poses = report.passed.then(|| poses_at(&base_from_part, recipe, robot));
    report.looks = Some(disagreement);
    Ok(report)
}

/// The gate of recipes that require more than one scan; several scans pass it together.
const LOOKS: &str = "number of looks";

/// The gates that a single scan missed, in words.
fn missed(gates: &[Gate]) -> impl Iterator<Item = String> {
    gates.iter().filter(|g| !g.passed && g.name != LOOKS).map(Gate::words)
}

/// What the recipe requires of a part and of the measured pose.
fn gates(g: &Gates, part: &Examined, lead: f64, budget: &Budget, disagreement: Option<(f64, f64)>) -> Vec<Gate> {
    let (least, most, agreement) = (Gate::least, Gate::most, &part.agreement);
    let mut out = vec![
        least("score", part.found.score, g.min_score),
        least("margin", lead, g.min_margin),
        least("coverage", agreement.coverage, g.min_coverage),
        least("agreement", agreement.agreement, g.min_agreement),
        least("edges seen", agreement.edges, g.min_edges),
        most("edges crossed", agreement.crossed, g.max_crossed),
        most("sigma_mm", budget.sigma_mm.iter().copied().fold(0.0, f64::max), g.max_sigma_mm),
        most("sigma_deg", budget.sigma_deg.iter().copied().fold(0.0, f64::max), g.max_sigma_deg),
    ];
    if let Some(d) = disagreement {
        out.push(most("disagreement_mm", beyond_noise(d), g.max_disagreement_mm));
    }
    if g.turn_must_be_told {
        out.extend(part.turns.iter().map(TurnVote::gate));
    }
    if g.second_look {
        out.push(least(LOOKS, 1.0, 2.0));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::Along;
    use std::path::Path;

    /// Two constructions 0.25 mm apart, each with a scatter of 0.12 mm, are 0.18 mm apart on average beyond their
    /// noise.
    #[test]
    fn noise_is_no_disagreement() {
        assert!((beyond_noise((0.25, 0.12 * std::f64::consts::SQRT_2)) - 0.183).abs() < 1e-3);
        assert_eq!(beyond_noise((0.1, 0.17)), 0.0);
        assert_eq!(beyond_noise((2.54, 0.0)), 2.54);
    }

    /// The clock oscillator's socket by its recipe, 3 mm above a table. Where its two turns differ, there are only
    /// `told_by` points, all of them in the cut corner; the opposite corner has none.
    fn socket(recipe: &Recipe, told_by: usize) -> Ordered {
        let drawing = recipe.drawing();
        let top = &drawing.faces()[0];
        let mut left = told_by;
        let mut cloud = Vec::new();
        for shot in 0..120u32 {
            for column in 0..160u32 {
                let (x, y) = (0.2 * f64::from(column) - 16.0, 0.2 * f64::from(shot) - 12.0);
                let here = top.material(x, y);
                if here != top.material(-x, -y) {
                    if here || left == 0 {
                        continue;
                    }
                    left -= 1;
                }
                let position = glam::Vec3::new(x as f32, y as f32, if here { 0.0 } else { -3.0 });
                let (u, v) = (column as f32, 200.0);
                cloud.push(CloudPoint { position, sigma_mm: 0.02, intensity: 100.0, quality: 1.0, shot, u, v });
            }
        }
        Ordered::new(&cloud, &Shots::unplaced(Along::U)).unwrap()
    }

    #[test]
    fn a_turn_that_few_points_tell_is_asked_for_at_the_other_pose_too() {
        let recipe = Recipe::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("data/recipes/osc.toml")).unwrap();
        let points = socket(&recipe, 30);
        let drawing = recipe.drawing();
        let right = measure(&points, &drawing, Rigid::identity(), &recipe.measure).unwrap();
        let votes = |m: &Measured| vote(&points, &drawing, &m.base_from_part, recipe.alike_turns, &recipe.measure)[0];
        assert_eq!(votes(&right).told(), Some(true), "{:?}", votes(&right));
        // Turned by half a turn and shifted step by step. At first the points vote against this pose, then they lie
        // beside its edges. From half a millimetre on they seem to vote for it, but no measurement ends there.
        let half: Rigid<Part, Part> = Rigid::from_vectors(&(Vec3::z() * std::f64::consts::PI), Vec3::zeros());
        let mut left_open = 0;
        for step in 0..100 {
            let aside = Rigid::from_vectors(&Vec3::zeros(), Vec3::new(1.0, 1.0, 0.0) * (0.01 * f64::from(step)));
            let wrong = Measured { base_from_part: aside * right.base_from_part * half, ..right.clone() };
            if votes(&wrong).told() == Some(true) {
                break;
            }
            left_open += usize::from(votes(&wrong).told().is_none());
            let mut notes = Vec::new();
            let (found, turns) = right_way_round(&points, &recipe, false, wrong.clone(), &mut notes).unwrap();
            let off = found.base_from_part.rotation_vector().norm().to_degrees();
            assert!(off < 1.0 && turns[0].told() == Some(true), "step {step}: {off} degrees, {turns:?}, {notes:?}");
            assert_eq!(notes.len(), 1);
            // An expected pose is retained where the points do not decide.
            if votes(&wrong).told().is_none() {
                let (kept, _) = right_way_round(&points, &recipe, true, wrong.clone(), &mut notes).unwrap();
                assert_eq!(kept.base_from_part, wrong.base_from_part);
            }
        }
        assert!(left_open >= 3, "{left_open} poses left it open");
    }
}
