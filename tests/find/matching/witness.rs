//! In: pictures of brackets whose edges agree only in part, and clutter without any. Out: judgement on the correlation
//! as a second witness of matches with a low score.
//! Frame and unit: pixels of 320x256 pictures.

use super::scenes::{H, PARTS, Picture, Thing, W, draw};
use crate::shapes::printed;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use sheetlight::find::{Match, ModelOptions, Pose, Scene, SearchOptions, Template, Weak, find_in, find_taught};
use sheetlight::raster::Image;

fn taught(image: &Image, region: [u32; 4]) -> Template {
    let source = ("a.png".to_owned(), "0".repeat(64));
    Template::teach("part", image, Some(region), source, &ModelOptions::default()).unwrap()
}

fn three() -> [Pose; 3] {
    let pose = |x, y, degrees: f64| Pose { x, y, angle: degrees.to_radians(), scale: 1.0 };
    [pose(70.2, 70.7, 0.0), pose(200.4, 80.1, 41.0), pose(120.6, 190.3, -4.0)]
}

fn at_all(found: &[Match]) -> bool {
    found.len() == 3 && three().iter().all(|p| found.iter().any(|m| (m.pose.x - p.x).hypot(m.pose.y - p.y) < 0.5))
}

/// Print hides the outline's share of the edges, not that of the grey levels.
#[test]
fn parts_with_weak_scores_are_accepted_by_their_grey_levels() {
    let still = [Pose { x: 160.0, y: 128.0, angle: 0.0, scale: 1.0 }];
    let template = taught(&printed(&still, 1, false), [112, 88, 97, 81]);
    let scene = Scene::from_image(&printed(&three(), 2, false));
    let options = SearchOptions { min_score: 0.8, ..SearchOptions::default().at_most(20) };
    let weak = Weak::default();
    let alone = find_taught(&scene, &template, &options, None, None, None).unwrap();
    assert!(alone.is_empty(), "{alone:?}");
    let found = find_taught(&scene, &template, &options, Some(&weak), None, None).unwrap();
    for m in &found {
        println!("{:.2} {:.2} px, score {:.3}, correlation {:.3}", m.pose.x, m.pose.y, m.score, m.correlation.unwrap());
    }
    assert!(at_all(&found) && found.iter().all(|m| m.correlation.unwrap() > 0.8 && m.score < 0.8));
    // Stricter limits, and another witness than the grey levels say.
    let strict = Weak { min_correlation: 0.999, ..weak };
    assert!(find_taught(&scene, &template, &options, Some(&strict), None, None).unwrap().is_empty());
    let mut without = template.clone();
    without.levels = None;
    assert!(find_taught(&scene, &without, &options, Some(&weak), None, None).unwrap().is_empty());
    assert!(find_taught(&scene, &template, &options, Some(&Weak { min_score: 0.05, ..weak }), None, None).is_err());
    // Reversed grey levels count where polarity is ignored.
    let negative = Scene::from_image(&printed(&three(), 2, true));
    assert!(find_taught(&negative, &template, &options, Some(&weak), None, None).unwrap().is_empty());
    let either = SearchOptions { ignore_polarity: true, ..options };
    let found = find_taught(&negative, &template, &either, Some(&weak), None, None).unwrap();
    assert!(at_all(&found) && found.iter().all(|m| m.correlation.unwrap() < -0.8), "{found:?}");
}

fn image(scene: &Scene) -> Image {
    Image::from_u8(W as u32, H as u32, scene.layers[0].values.iter().map(|v| *v as u8).collect())
}

/// Clutter of boxes and discs like the parts': what the lower limit lets through there, and that matches above the
/// search's own limit stay as they were.
#[test]
fn clutter_is_not_accepted_and_other_matches_stay() {
    let (mut rng, mut searches, mut before, mut more) = (Pcg64::seed_from_u64(9), 0, 0, 0);
    for (name, part) in PARTS {
        let pose = Pose { x: 160.0, y: 128.0, angle: 0.0, scale: 1.0 };
        let still = Picture { parts: vec![(part, pose, 160.0)], back: 60.0, under: vec![], over: vec![], noise: 1.0 };
        let template = taught(&image(&draw(&still, &mut rng)), [112, 84, 97, 89]);
        for _ in 0..10 {
            let under = (0..rng.random_range(10..40)).map(|_| Thing::random(&mut rng, 20.0..235.0)).collect();
            let clutter = Picture { parts: vec![], back: 110.0, under, over: vec![], noise: 4.0 };
            let scene = draw(&clutter, &mut rng);
            let options = SearchOptions::default().at_most(50);
            let plain = find_in(&scene, &template.model, &options, None, None).unwrap();
            let found = find_taught(&scene, &template, &options, Some(&Weak::default()), None, None).unwrap();
            let strong: Vec<&Match> = found.iter().filter(|m| m.score >= options.min_score).collect();
            assert!(strong.len() >= plain.len());
            assert!(plain.iter().all(|p| strong.iter().any(|m| m.pose == p.pose && m.score == p.score)), "{name}");
            searches += 1;
            before += plain.len();
            more += found.len() - plain.len();
        }
    }
    println!("{searches} pictures of clutter: {before} false matches by edges, {more} more by grey levels");
    assert_eq!(more, 0);
}
