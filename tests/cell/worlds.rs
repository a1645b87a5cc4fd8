//! In: simulated cells in which something else lies than the recipe says, or in which a light does not follow its
//! output. Out: whether the job keeps away from it, and says why with numbers.
//! Frame and unit: mm, degrees.

use super::workplace::{Set, Yes, scene, set_but};
use sheetlight::simulate::{CutSpec, Material, SceneSpec, ShapeSpec, SolidSpec};
use sheetlight::station::job::{JobReport, Outcome};
use sheetlight_program::cell::Event;

/// A world that is not as the recipe of the oscillator has it.
struct World {
    name: &'static str,
    /// What lies there.
    lies: fn(&mut SceneSpec),
    /// What is wrong with the cell.
    cell: fn(&Set),
    /// Added to the recipe.
    recipe: &'static str,
    /// The last step that a person is asked about.
    asked: &'static str,
    /// Words of the reason.
    says: &'static str,
}

const AS_IT_IS: World = World { name: "", lies: |_| {}, cell: |_| {}, recipe: "", asked: "scan", says: "" };

fn block(size_mm: [f64; 3], at_mm: [f64; 3]) -> SolidSpec {
    let material = Material { albedo: 0.5, ..Material::default() };
    let (shape, cut) = (ShapeSpec::Block { size_mm }, vec![]);
    SolidSpec { shape, at_mm, turn_deg: 0.0, material, cut, repeat: [1, 1], pitch_mm: [0.0; 2] }
}

/// Cuts that are seen while nothing but the light or the board is wrong: few pictures are taken.
fn lights() -> Vec<World> {
    vec![
        World {
            name: "the pointer does not switch",
            cell: |s| s.served.cell.stick(25, Some(false)),
            asked: "",
            says: "spot",
            ..AS_IT_IS
        },
        World {
            name: "the line does not switch",
            cell: |s| s.served.cell.stick(24, Some(false)),
            asked: "touch",
            says: "line",
            ..AS_IT_IS
        },
        World {
            name: "neither board nor table",
            lies: |s| {
                s.solid.clear();
                s.part[0].at_mm[2] -= 900.0;
            },
            asked: "",
            says: "spot",
            ..AS_IT_IS
        },
    ]
}

/// What only the scan tells.
fn parts() -> Vec<World> {
    vec![
        World {
            name: "half hidden",
            lies: |s| {
                let at = s.part[0].at_mm;
                s.solid.push(block([13.0, 24.0, 3.0], [at[0] + 7.0, at[1], at[2] + 3.0]));
            },
            says: "not found|no pose",
            ..AS_IT_IS
        },
        World {
            name: "on a slope",
            lies: |s| {
                s.part[0].tilt_deg = [0.0, 5.0];
                s.part[0].at_mm[2] += 1.0;
            },
            says: "off the touched board, limit 3",
            ..AS_IT_IS
        },
        World { name: "missing", lies: |s| s.part.clear(), says: "not found|no pose", ..AS_IT_IS },
        World {
            name: "turned beyond the recipe",
            lies: |s| s.part[0].turn_deg += 40.0,
            recipe: "[search]\nmin_score = 0.5\nangles_deg = [-15, 15]\n",
            says: "not found|no pose",
            ..AS_IT_IS
        },
        World {
            name: "mirrored",
            lies: |s| {
                // The cut corner on the other side.
                let corner: &mut CutSpec = s.part[0].solid[0].cut.last_mut().unwrap();
                (corner.at_mm[0], corner.turn_deg) = (-corner.at_mm[0], -corner.turn_deg);
            },
            says: "not found|no pose",
            ..AS_IT_IS
        },
        World {
            name: "no board, the table",
            lies: |s| {
                s.part.clear();
                s.solid.remove(0);
            },
            says: "not found|no pose",
            ..AS_IT_IS
        },
    ]
}

/// Runs the job in a world; the sweep is in coarse steps unless `fine`.
fn tried(world: &World, seed: u64, fine: bool) -> (Set, JobReport, Yes) {
    let set = set_but(scene("osc", seed), seed, 2.0, world.lies);
    (world.cell)(&set);
    let mut options = set.options("osc.toml", "job", if fine { 34.0 } else { 26.0 });
    let mut recipe = std::fs::read_to_string(&options.recipe).unwrap();
    if !fine {
        recipe = recipe.replace("cell_mm = 0.5", "cell_mm = 1.0");
    }
    if !world.recipe.is_empty() {
        recipe = recipe.replace("[search]\nmin_score = 0.5\n", world.recipe);
    }
    options.recipe = set.dir.path().join("recipe.toml");
    std::fs::write(&options.recipe, recipe).unwrap();
    let mut who = Yes::always();
    let report = set.run(&options, &mut who).unwrap();
    (set, report, who)
}

/// No motion towards the part, and a reason with a number in it.
fn kept_away(world: &World, seed: u64, fine: bool) {
    let (set, report, who) = tried(world, seed, fine);
    let name = world.name;
    println!("{name}, seed {seed}: {}", report.why);
    assert_eq!(report.outcome, Outcome::Stopped, "{name} {seed}");
    assert!(
        world.says.split('|').any(|w| report.why.contains(w)) && report.why.chars().any(|c| c.is_ascii_digit()),
        "{name}: {}",
        report.why
    );
    assert_eq!(who.asked.last().copied().unwrap_or(""), world.asked, "{name} {seed}: {:?}", who.asked);
    let log = set.served.cell.log();
    let bad = log.iter().find(|e| matches!(e.event, Event::Released(_) | Event::Collision { .. }));
    assert!(bad.is_none(), "{name} {seed}: {bad:?}");
    // Nothing went lower than from where the pointer touches.
    let start = set.served.cell.true_flange(0.0).translation.z;
    let lowest = log.iter().filter_map(|e| match &e.event {
        Event::Move { to, .. } => Some(start - to.translation.z),
        _ => None,
    });
    let depth = set.served.cell.station().working_distance;
    let lowest = lowest.fold(0.0, f64::max);
    assert!(lowest < 1.25 * depth, "{name} {seed}: {lowest} mm down, the sensor works at {depth}");
}

#[test]
fn lights_and_boards_that_are_not_there_end_the_job_before_the_sweep() {
    lights().iter().for_each(|w| kept_away(w, 2, false));
}

#[test]
fn a_part_that_is_half_hidden_or_on_a_slope_is_left_alone() {
    parts()[..2].iter().for_each(|w| kept_away(w, 2, false));
}

#[test]
fn nothing_moves_towards_what_the_recipe_does_not_have() {
    if std::env::var_os("SHEETLIGHT_LONG").is_none() {
        return;
    }
    for world in lights().iter().chain(&parts()) {
        (1..=4).for_each(|seed| kept_away(world, seed, true));
    }
}
