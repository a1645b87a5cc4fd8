//! In: finished scans, a recipe or a few positions of a part. Out: the tool's poses, as the page Position shows
//! them.
//! Frame and unit: the scan's frame, outlines in the height map's grid; mm, degrees.

use super::found::{FOUND, RECIPE};
use super::recipes::{save_recipe, vacant};
use super::run::Run;
use crate::procedure::{Located, Names};
use crate::web::message::{FindOrder, GateLight, Notation, Outcome, Position, RobotPoses, TeachOrder, Term};
use sheetlight::fault::Result;
use sheetlight::find::insert::budget::Term as BudgetTerm;
use sheetlight::find::insert::recipe::InsertionSpec;
use sheetlight::find::insert::teach::TeachOptions;
use sheetlight::find::{Recipe, Report};
use sheetlight::geometry::Vec3;
use sheetlight::raster::RgbImage;
use sheetlight::robot::Convention;
use sheetlight::station::{Settings, teach_part};

pub(super) fn find(this: &Run, order: &FindOrder) -> Result<Outcome> {
    let Located { report, recipe, picture, notation } = order.find(this, Some(&this.jobs.place.station), false)?;
    keep(this, &report, &recipe, &picture)?;
    Ok(Outcome::Find(Box::new(position(&report, &recipe, notation))))
}

pub(super) fn teach(this: &Run, order: &TeachOrder) -> Result<Outcome> {
    let place = &this.jobs.place;
    vacant(place, &order.name, order.replace)?;
    let options = TeachOptions {
        name: order.name.clone(),
        outline: order.outline,
        angle_deg: order.angle_deg,
        windows: order.windows.clone(),
        holes: order.holes.clone(),
        insertion: InsertionSpec::at_the_part(
            (order.tolerance_mm, order.tolerance_deg),
            order.approach_mm,
            order.approach_mm,
        ),
    };
    let (recipe, proof, picture) = teach_part(&this.scan(&order.scan)?, &options)?;
    let text = toml::to_string(&recipe).expect("plain data");
    keep(this, &proof, &recipe, &picture)?;
    save_recipe(place, &order.name, &text, order.replace)?;
    let convention = Settings::load(&place.station)?.robot.unwrap_or(Convention::Matrix);
    let proof = Box::new(position(&proof, &recipe, convention));
    Ok(Outcome::Teach { recipe: order.name.clone(), proof })
}

/// Stores report, picture and the recipe used; later edits of the recipe do not change them.
fn keep(this: &Run, report: &Report, recipe: &Recipe, picture: &RgbImage) -> Result<()> {
    let text = serde_json::to_string_pretty(report).expect("plain data");
    let recipe = toml::to_string(recipe).expect("plain data");
    let [json, png, toml] = [FOUND, "found.png", RECIPE].map(|name| this.folder.join(name));
    sheetlight::files::write_beside((&json, text.as_bytes()), &[(&png, &picture.to_png()), (&toml, recipe.as_bytes())])
}

/// The report as the page shows it.
pub(super) fn position(r: &Report, recipe: &Recipe, convention: Convention) -> Position {
    let poses = r.poses.as_ref().map(|p| {
        let stated =
            serde_json::to_vec(&(&p.approach.base_from_tool, &p.insertion.base_from_tool, &p.retract.base_from_tool));
        let notations = Convention::ALL.iter().map(|c| Notation {
            name: c.name().into(),
            labels: labels(*c),
            numbers: c.write(&p.insertion.base_from_tool),
        });
        RobotPoses {
            hash: sheetlight::rig::hash_text(&stated.expect("plain data"))[..16].into(),
            convention: convention.name().into(),
            labels: labels(convention),
            approach: p.approach.numbers.clone(),
            insertion: p.insertion.numbers.clone(),
            retract: p.retract.numbers.clone(),
            notations: notations.collect(),
        }
    });
    let term = |t: &BudgetTerm| Term {
        name: t.name.into(),
        sigma_mm: t.sigma_mm,
        sigma_deg: t.sigma_deg,
        note: t.note.clone(),
    };
    Position {
        recipe: r.recipe.clone(),
        frame: r.frame.clone(),
        passed: r.passed,
        reasons: r.reasons.clone(),
        poses,
        sigma_mm: r.sigma_mm,
        sigma_deg: r.sigma_deg,
        tolerance_mm: r.tolerance_mm,
        tolerance_deg: r.tolerance_deg,
        within_tolerance: r.within_tolerance,
        terms: r.budget.terms.iter().map(term).collect(),
        complete: r.budget.complete,
        gates: r.gates.iter().map(GateLight::from).collect(),
        score: r.found.score,
        second_score: r.found.second_score,
        part: r.base_from_part.to_rows(),
        outline: outline(r, recipe),
        notes: r.notes.clone(),
    }
}

pub(super) fn labels(c: Convention) -> Vec<String> {
    c.labels().iter().map(|l| (*l).to_owned()).collect()
}

/// Outlines of the drawing at the measured pose of the part.
fn outline(r: &Report, recipe: &Recipe) -> Vec<Vec<[f64; 2]>> {
    let grid_from_part = r.map.base_from_grid.inverse() * r.base_from_part;
    let place = |p: &[f64; 2]| {
        let q = grid_from_part.point(&Vec3::new(p[0], p[1], 0.0));
        [q.x, q.y]
    };
    let line = |(points, closed): (Vec<[f64; 2]>, bool)| {
        let again = points.first().copied().filter(|_| closed);
        points.iter().chain(&again).map(place).collect()
    };
    recipe.drawing().polylines().into_iter().map(line).collect()
}
